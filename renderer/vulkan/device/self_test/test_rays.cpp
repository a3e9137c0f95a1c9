#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/ray_pipeline.h"
#include "renderer/vulkan/device/self_test/self_test.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

#include <helio_shaders/self_test_rahit.h>
#include <helio_shaders/self_test_rchit.h>
#include <helio_shaders/self_test_rgen.h>
#include <helio_shaders/self_test_rmiss.h>

namespace helio::vulkan {

namespace {

constexpr std::uint32_t kSide = 8, kTriangles = 4;

// Two rectangles: 4 x 8 at z = 0 in front of 8 x 4 at z = -1.
struct Vertex {
  float x, y, z;
};
constexpr Vertex kVertices[kTriangles][3] = {
    {{0, 0, 0}, {4, 0, 0}, {4, 8, 0}},
    {{0, 0, 0}, {4, 8, 0}, {0, 8, 0}},
    {{0, 0, -1}, {8, 0, -1}, {8, 4, -1}},
    {{0, 0, -1}, {8, 4, -1}, {0, 4, -1}},
};

struct Answer {
  std::int32_t triangle;
  float distance;
  std::uint32_t occluded, seen;
};

struct Push {
  std::uint64_t scene, answers;
};

// An acceleration structure and its memory.
struct Structure {
  std::shared_ptr<Device> device;
  Buffer memory, scratch;
  VkAccelerationStructureKHR handle = VK_NULL_HANDLE;

  Structure() = default;
  Structure(const Structure&) = delete;
  ~Structure() {
    if (handle && !device->lost()) device->api().vkDestroyAccelerationStructureKHR(device->handle(), handle, nullptr);
  }
};

Status build(Structure& structure, CommandSlot& slot, VkAccelerationStructureTypeKHR type,
             const VkAccelerationStructureGeometryKHR& geometry, std::uint32_t primitives) {
  Device& device = *structure.device;
  const VolkDeviceTable& api = device.api();
  auto info = vulkan_struct<VkAccelerationStructureBuildGeometryInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR);
  info.type = type;
  info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
  info.geometryCount = 1;
  info.pGeometries = &geometry;
  auto sizes = vulkan_struct<VkAccelerationStructureBuildSizesInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR);
  api.vkGetAccelerationStructureBuildSizesKHR(device.handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &info,
                                              &primitives, &sizes);
  auto memory = Buffer::create(structure.device, sizes.accelerationStructureSize, Memory::device,
                               "an acceleration structure", VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR);
  if (!memory) return std::move(memory).error();
  structure.memory = std::move(memory).value();
  const std::uint64_t alignment = device.ray_limits().scratch_alignment;
  auto scratch = Buffer::create(structure.device, sizes.buildScratchSize + alignment, Memory::device,
                                "scratch memory of an acceleration structure");
  if (!scratch) return std::move(scratch).error();
  structure.scratch = std::move(scratch).value();
  auto create =
      vulkan_struct<VkAccelerationStructureCreateInfoKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR);
  create.buffer = structure.memory.handle();
  create.size = sizes.accelerationStructureSize;
  create.type = type;
  if (const VkResult result =
          api.vkCreateAccelerationStructureKHR(device.handle(), &create, nullptr, &structure.handle);
      result != VK_SUCCESS) {
    return vulkan_error(device, result, "vkCreateAccelerationStructureKHR");
  }
  info.dstAccelerationStructure = structure.handle;
  info.scratchData.deviceAddress = (structure.scratch.address() + alignment - 1) / alignment * alignment;
  const VkAccelerationStructureBuildRangeInfoKHR range{primitives, 0, 0, 0};
  const VkAccelerationStructureBuildRangeInfoKHR* ranges = &range;
  return slot.run([&](const VolkDeviceTable&, VkCommandBuffer commands) {
    api.vkCmdBuildAccelerationStructuresKHR(commands, 1, &info, &ranges);
  });
}

Status build_triangles(Structure& structure, CommandSlot& slot, Arena& arena) {
  const auto vertices = arena.upload(std::as_bytes(std::span(kVertices)), 16, "vertices of the self-test");
  if (!vertices) return vertices.error();
  auto geometry =
      vulkan_struct<VkAccelerationStructureGeometryKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR);
  geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
  geometry.flags = VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR;
  geometry.geometry.triangles = vulkan_struct<VkAccelerationStructureGeometryTrianglesDataKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR);
  geometry.geometry.triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
  geometry.geometry.triangles.vertexData.deviceAddress = *vertices;
  geometry.geometry.triangles.vertexStride = sizeof(Vertex);
  geometry.geometry.triangles.maxVertex = kTriangles * 3 - 1;
  geometry.geometry.triangles.indexType = VK_INDEX_TYPE_NONE_KHR;
  return build(structure, slot, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, geometry, kTriangles);
}

Status build_top(Structure& structure, CommandSlot& slot, Arena& arena, const Structure& bottom) {
  Device& device = *structure.device;
  auto address_of = vulkan_struct<VkAccelerationStructureDeviceAddressInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR);
  address_of.accelerationStructure = bottom.handle;
  VkAccelerationStructureInstanceKHR instance{};
  instance.transform = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  instance.mask = 0xff;
  instance.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
  instance.accelerationStructureReference =
      device.api().vkGetAccelerationStructureDeviceAddressKHR(device.handle(), &address_of);
  const auto instances = arena.upload_value(instance, "the instance of the self-test");
  if (!instances) return instances.error();
  auto geometry =
      vulkan_struct<VkAccelerationStructureGeometryKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR);
  geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
  geometry.geometry.instances = vulkan_struct<VkAccelerationStructureGeometryInstancesDataKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR);
  geometry.geometry.instances.data.deviceAddress = *instances;
  return build(structure, slot, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, geometry, 1);
}

// Whether the ray at (x, y) goes through the triangle; none of the rays meets an edge.
bool covers(const Vertex (&triangle)[3], float x, float y) {
  for (int k = 0; k < 3; ++k) {
    const Vertex &a = triangle[k], &b = triangle[(k + 1) % 3];
    if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) < 0) return false;
  }
  return true;
}

Status check(const Answer& found, std::uint32_t i, std::uint32_t j) {
  std::int32_t expected = -1;
  for (std::int32_t triangle : {0, 2, 3}) {  // front to back; 1 is ignored
    if (covers(kVertices[triangle], float(i) + 0.37f, float(j) + 0.21f)) {
      expected = triangle;
      break;
    }
  }
  const std::string ray = "ray (" + std::to_string(i) + ", " + std::to_string(j) + ")";
  if (found.triangle != expected) {
    return Error{ErrorCode::internal,
                 ray + " hit triangle " + std::to_string(found.triangle) + "; expected: " + std::to_string(expected) +
                     " (-1: none)",
                 {}};
  }
  if (found.occluded != (expected >= 0 ? 1u : 0u)) {
    return Error{ErrorCode::internal,
                 ray + (found.occluded ? " was occluded" : " was not occluded") + " and its closest hit is triangle " +
                     std::to_string(expected) + " (-1: none)",
                 {}};
  }
  if (expected < 0) return ok_status();
  const float distance = 2 - kVertices[expected][0].z;
  if (!(std::abs(found.distance - distance) < 1e-5f)) {
    return Error{ErrorCode::internal,
                 ray + " hit at distance " + std::to_string(found.distance) + "; expected: " + std::to_string(distance),
                 {}};
  }
  if (!(found.seen & (1u << expected)))
    return Error{ErrorCode::internal, ray + ": the any-hit shader was not called for its hit", {}};
  return ok_status();
}

}  // namespace

Status test_rays(const std::shared_ptr<Device>& device) {
  HELIO_CHECK(device->level() == Level::rt);
  Arena arena(device);
  auto slot = CommandSlot::create(device);
  if (!slot) return std::move(slot).error();
  Structure bottom, top;
  bottom.device = top.device = device;
  if (Status built = build_triangles(bottom, *slot, arena); !built) return built;
  if (Status built = build_top(top, *slot, arena, bottom); !built) return built;

  const auto pipeline = RayPipeline::create(
      device, {self_test_rgen, {self_test_rmiss}, {{self_test_rchit, self_test_rahit, {}}}}, sizeof(Push));
  if (!pipeline) return pipeline.error();
  const auto answers = Buffer::create(device, kSide * kSide * sizeof(Answer), Memory::host, "answers of the self-test");
  if (!answers) return answers.error();
  std::memset(answers->mapped().data(), 0xee, answers->bytes());
  auto address_of = vulkan_struct<VkAccelerationStructureDeviceAddressInfoKHR>(
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR);
  address_of.accelerationStructure = top.handle;
  const Push push{device->api().vkGetAccelerationStructureDeviceAddressKHR(device->handle(), &address_of),
                  answers->address()};
  const Status traced = slot->run([&](const VolkDeviceTable&, VkCommandBuffer commands) {
    pipeline->trace(commands, std::as_bytes(std::span(&push, 1)), kSide, kSide);
  });
  if (!traced) return traced;
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kSide; ++i) {
      if (Status right = check(answers->mapped_as<Answer>()[j * kSide + i], i, j); !right) return right;
    }
  }
  return ok_status();
}

}  // namespace helio::vulkan
