#include "renderer/vulkan/scene/acceleration_structures.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "renderer/vulkan/device/commands.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {
namespace {

constexpr std::uint64_t kStructureAlignment = 256;            // of VkAccelerationStructureCreateInfoKHR::offset
constexpr std::uint64_t kLargestBuffer = 1u << 30;            // bytes of bottom levels that share one
constexpr std::chrono::nanoseconds kTimePerPrimitive{10000};  // that a build may take, on top of kSubmissionLimit
// Software devices sort so many primitives on one core for a fast trace, at 3 us each; beyond, they build fast.
constexpr std::uint64_t kMostForFastTrace = 1u << 18;

std::uint64_t align_up(std::uint64_t value, std::uint64_t alignment) {
  return (value + alignment - 1) / alignment * alignment;
}

// A structure with the geometries that it is built of.
struct Structure {
  VkAccelerationStructureTypeKHR type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
  std::vector<VkAccelerationStructureGeometryKHR> geometries;
  std::vector<VkAccelerationStructureBuildRangeInfoKHR> ranges;
  std::vector<std::uint32_t> parts;  // by geometry, as in Hit
  std::uint64_t primitives = 0;
  std::uint64_t bytes = 0, scratch_bytes = 0;
  VkAccelerationStructureKHR handle = VK_NULL_HANDLE;
  std::uint64_t address = 0;

  VkAccelerationStructureBuildGeometryInfoKHR info(bool software) const {
    auto build = vulkan_struct<VkAccelerationStructureBuildGeometryInfoKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR);
    build.type = type;
    build.flags = software && primitives > kMostForFastTrace
                      ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR
                      : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
    build.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
    build.geometryCount = std::uint32_t(geometries.size());
    build.pGeometries = geometries.data();
    build.dstAccelerationStructure = handle;
    return build;
  }
};

VkAccelerationStructureGeometryKHR geometry_of(VkGeometryTypeKHR type, bool opaque) {
  auto geometry =
      vulkan_struct<VkAccelerationStructureGeometryKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR);
  geometry.geometryType = type;
  geometry.flags = opaque ? VK_GEOMETRY_OPAQUE_BIT_KHR : VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR;
  return geometry;
}

Error too_many(std::uint64_t count, const char* what, std::uint64_t limit, const Device& device) {
  return {ErrorCode::resource_exhausted,
          std::to_string(count) + " " + what + "; " + device.info().name + " allows at most " + std::to_string(limit) +
              " in one acceleration structure",
          {}};
}

}  // namespace

class StructureBuild {
 public:
  StructureBuild(SceneGeometry& geometry, Arena& arena, const CancelToken* cancel)
      : geometry_(geometry), arena_(arena), cancel_(cancel), device_(arena.device()), api_(device_->api()) {
    made_.device_ = device_;
  }

  Result<AccelerationStructures> run() {
    if (Status boxes = upload_boxes(); !boxes) return boxes.error();
    make_structures();
    if (structures_.empty()) return std::move(made_);
    if (Status built = build(structures_); !built) return built.error();
    if (Status top = build_top(); !top) return top.error();
    return std::move(made_);
  }

 private:
  // The triangles and the spheres of the flat parts or of an object; indices into structures_, or kNone.
  struct Pair {
    std::uint32_t triangles = kNone, spheres = kNone;
  };

  Status upload_boxes() {
    std::vector<VkAabbPositionsKHR> boxes;
    for (std::size_t i = 0; i < geometry_.parts.size(); ++i) {
      if (geometry_.meshes[i]) continue;
      // A little larger than the sphere, for the driver's rounding.
      const V3f& c = geometry_.parts[i].center;
      const float largest = std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)});
      const float r = geometry_.parts[i].radius * (1 + 0x1p-20f) + largest * 0x1p-21f;
      boxes.push_back({c.x - r, c.y - r, c.z - r, c.x + r, c.y + r, c.z + r});
    }
    auto placed = arena_.upload(std::as_bytes(std::span(boxes)), 16, "boxes of spheres");
    if (!placed) return std::move(placed).error();
    boxes_ = *placed;
    return ok_status();
  }

  void make_structures() {
    flat_ = make_pair(0, geometry_.flat_count);
    for (const std::uint32_t instance : geometry_.first_instances()) {
      objects_.push_back(make_pair(geometry_.instances[instance].first_part, geometry_.part_counts[instance]));
    }
  }

  Pair make_pair(std::uint32_t first, std::uint32_t count) {
    Structure triangles, spheres;
    for (std::uint32_t part = first; part < first + count; ++part) {
      if (!geometry_.meshes[part]) {
        const std::uint32_t box = next_box_++;
        if (geometry_.traced[part]) add_sphere(spheres, part, part - first, box);
      } else if (geometry_.traced[part]) {
        add_triangles(triangles, part, part - first);
      }
    }
    Pair pair;
    for (auto [structure, index] : {std::pair(&triangles, &pair.triangles), std::pair(&spheres, &pair.spheres)}) {
      if (structure->geometries.empty()) continue;
      *index = std::uint32_t(structures_.size());
      structures_.push_back(std::move(*structure));
    }
    return pair;
  }

  void add_triangles(Structure& structure, std::uint32_t index, std::uint32_t part) const {
    const TriangleMesh& mesh = *geometry_.meshes[index];
    const PartTable& table = geometry_.parts[index];
    auto geometry = geometry_of(VK_GEOMETRY_TYPE_TRIANGLES_KHR, !(table.flags & kPartAlpha));
    auto& triangles = geometry.geometry.triangles;
    triangles = vulkan_struct<VkAccelerationStructureGeometryTrianglesDataKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR);
    triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    triangles.vertexData.deviceAddress = table.positions;
    triangles.vertexStride = sizeof(V3f);
    triangles.maxVertex = std::uint32_t(mesh.positions.size() - 1);
    triangles.indexType = VK_INDEX_TYPE_UINT32;
    triangles.indexData.deviceAddress = table.indices;
    add(structure, geometry, part, mesh.triangle_count());
  }

  void add_sphere(Structure& structure, std::uint32_t index, std::uint32_t part, std::uint32_t box) const {
    auto geometry = geometry_of(VK_GEOMETRY_TYPE_AABBS_KHR, !(geometry_.parts[index].flags & kPartAlpha));
    auto& aabbs = geometry.geometry.aabbs;
    aabbs = vulkan_struct<VkAccelerationStructureGeometryAabbsDataKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR);
    aabbs.data.deviceAddress = boxes_ + box * sizeof(VkAabbPositionsKHR);
    aabbs.stride = sizeof(VkAabbPositionsKHR);
    add(structure, geometry, part, 1);
  }

  static void add(Structure& structure, const VkAccelerationStructureGeometryKHR& geometry, std::uint32_t part,
                  std::uint64_t primitives) {
    structure.geometries.push_back(geometry);
    structure.ranges.push_back({std::uint32_t(primitives), 0, 0, 0});
    structure.parts.push_back(part);
    structure.primitives += primitives;
  }

  bool software() const { return device_->info().type == "cpu"; }

  Status measure(Structure& structure) const {
    const auto info = structure.info(software());
    std::vector<std::uint32_t> counts;
    for (const auto& range : structure.ranges) counts.push_back(range.primitiveCount);
    auto sizes = vulkan_struct<VkAccelerationStructureBuildSizesInfoKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR);
    api_.vkGetAccelerationStructureBuildSizesKHR(device_->handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR,
                                                 &info, counts.data(), &sizes);
    structure.bytes = sizes.accelerationStructureSize;
    structure.scratch_bytes = sizes.buildScratchSize;
    return ok_status();
  }

  // Measures, places and builds structures of one type.
  Status build(std::span<Structure> structures) {
    const DeviceLimits& limits = device_->info().limits;
    std::uint64_t scratch_bytes = 0;
    for (Structure& structure : structures) {
      const bool top = structure.type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR;
      const std::uint64_t most = top ? limits.max_instances : limits.max_primitives;
      if (structure.primitives > most) {
        return too_many(structure.primitives, top ? "instances" : "triangles or spheres", most, *device_);
      }
      if (Status measured = measure(structure); !measured) return measured;
      scratch_bytes = std::max(scratch_bytes, structure.scratch_bytes);
    }
    for (std::size_t first = 0; first < structures.size();) {
      std::uint64_t bytes = 0;
      std::size_t end = first;
      do {
        bytes += align_up(structures[end++].bytes, kStructureAlignment);
      } while (end < structures.size() && bytes + structures[end].bytes <= kLargestBuffer);
      if (Status placed = place(structures.subspan(first, end - first), bytes); !placed) return placed;
      first = end;
    }
    const std::uint64_t alignment = std::max<std::uint64_t>(device_->ray_limits().scratch_alignment, 1);
    auto scratch = Buffer::create(device_, std::max<std::uint64_t>(scratch_bytes, 1) + alignment, Memory::device,
                                  "building acceleration structures");
    if (!scratch) return std::move(scratch).error();
    auto slot = CommandSlot::create(device_);
    if (!slot) return std::move(slot).error();
    for (std::size_t first = 0; first < structures.size();) {
      if (cancel_ && cancel_->cancelled()) return Error{ErrorCode::cancelled, "the build was cancelled", {}};
      std::uint64_t primitives = structures[first].primitives;
      std::size_t end = first + 1;
      while (end < structures.size() && primitives + structures[end].primitives <= kMostForFastTrace) {
        primitives += structures[end++].primitives;
      }
      const std::uint64_t scratch_address = align_up(scratch->address(), alignment);
      Status built = slot->run(
          [&](const VolkDeviceTable& api, VkCommandBuffer commands) {
            for (const Structure& structure : structures.subspan(first, end - first)) {
              auto info = structure.info(software());
              info.scratchData.deviceAddress = scratch_address;
              const VkAccelerationStructureBuildRangeInfoKHR* ranges = structure.ranges.data();
              api.vkCmdBuildAccelerationStructuresKHR(commands, 1, &info, &ranges);
              memory_barrier(api, commands);  // the next build uses the same scratch memory
            }
          },
          kSubmissionLimit + std::chrono::duration_cast<std::chrono::milliseconds>(kTimePerPrimitive * primitives));
      if (!built) return built;
      first = end;
    }
    return ok_status();
  }

  // Creates the structures in one buffer of so many bytes.
  Status place(std::span<Structure> structures, std::uint64_t bytes) {
    auto buffer = Buffer::create(device_, bytes, Memory::device, "acceleration structures",
                                 VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR);
    if (!buffer) return std::move(buffer).error();
    made_.buffers_.push_back(std::move(buffer).value());
    std::uint64_t offset = 0;
    for (Structure& structure : structures) {
      auto create =
          vulkan_struct<VkAccelerationStructureCreateInfoKHR>(VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR);
      create.buffer = made_.buffers_.back().handle();
      create.offset = offset;
      create.size = structure.bytes;
      create.type = structure.type;
      if (const VkResult result =
              api_.vkCreateAccelerationStructureKHR(device_->handle(), &create, nullptr, &structure.handle);
          result != VK_SUCCESS) {
        return vulkan_error(*device_, result, "vkCreateAccelerationStructureKHR");
      }
      made_.structures_.push_back(structure.handle);
      auto address = vulkan_struct<VkAccelerationStructureDeviceAddressInfoKHR>(
          VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR);
      address.accelerationStructure = structure.handle;
      structure.address = api_.vkGetAccelerationStructureDeviceAddressKHR(device_->handle(), &address);
      offset += align_up(structure.bytes, kStructureAlignment);
    }
    return ok_status();
  }

  Status build_top() {
    std::vector<std::uint32_t> ray_parts;
    std::vector<std::uint32_t> first_parts;  // of a bottom level, into ray_parts
    for (const Structure& structure : structures_) {
      first_parts.push_back(std::uint32_t(ray_parts.size()));
      ray_parts.insert(ray_parts.end(), structure.parts.begin(), structure.parts.end());
    }
    std::vector<VkAccelerationStructureInstanceKHR> instances;
    std::vector<RayInstanceTable> tables;
    const auto place_one = [&](std::uint32_t level, std::uint32_t hit_group, const V3f(&to_world)[4],
                               std::uint32_t number) {
      if (level == kNone) return;
      VkAccelerationStructureInstanceKHR instance{};
      for (int row = 0; row < 3; ++row) {
        for (int i = 0; i < 4; ++i) instance.transform.matrix[row][i] = to_world[i][row];
      }
      instance.mask = 0xff;
      instance.instanceShaderBindingTableRecordOffset = hit_group & 0xffffff;
      instance.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
      instance.accelerationStructureReference = structures_[level].address;
      instances.push_back(instance);
      tables.push_back({number, first_parts[level]});
    };
    const V3f identity[4] = {V3f(1, 0, 0), V3f(0, 1, 0), V3f(0, 0, 1), V3f(0, 0, 0)};
    place_one(flat_.triangles, kTriangleHitGroup, identity, kNone);
    place_one(flat_.spheres, kSphereHitGroup, identity, kNone);
    for (std::size_t i = 0; i < geometry_.instances.size(); ++i) {
      const Pair& object = objects_[geometry_.objects[i]];
      place_one(object.triangles, kTriangleHitGroup, geometry_.instances[i].to_world, std::uint32_t(i));
      place_one(object.spheres, kSphereHitGroup, geometry_.instances[i].to_world, std::uint32_t(i));
    }
    auto placed = arena_.upload(std::as_bytes(std::span(instances)), 16, "instances");
    if (!placed) return std::move(placed).error();

    Structure top;
    top.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR;
    auto geometry = geometry_of(VK_GEOMETRY_TYPE_INSTANCES_KHR, false);
    geometry.flags = 0;
    geometry.geometry.instances = vulkan_struct<VkAccelerationStructureGeometryInstancesDataKHR>(
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR);
    geometry.geometry.instances.data.deviceAddress = *placed;
    add(top, geometry, 0, instances.size());
    if (Status built = build(std::span(&top, 1)); !built) return built;

    auto ray_instances = arena_.upload(std::as_bytes(std::span(tables)), 16, "instances");
    if (!ray_instances) return std::move(ray_instances).error();
    auto parts = arena_.upload(std::as_bytes(std::span(ray_parts)), 16, "parts");
    if (!parts) return std::move(parts).error();
    geometry_.tables.top_level = top.address;
    geometry_.tables.ray_instances = *ray_instances;
    geometry_.tables.ray_parts = *parts;
    return ok_status();
  }

  SceneGeometry& geometry_;
  Arena& arena_;
  const CancelToken* const cancel_;
  const std::shared_ptr<Device> device_;
  const VolkDeviceTable& api_;
  AccelerationStructures made_;
  std::uint64_t boxes_ = 0;
  std::uint32_t next_box_ = 0;
  std::vector<Structure> structures_;
  Pair flat_;
  std::vector<Pair> objects_;
};

Result<AccelerationStructures> AccelerationStructures::build(SceneGeometry& geometry, Arena& arena,
                                                             const CancelToken* cancel) {
  return StructureBuild(geometry, arena, cancel).run();
}

AccelerationStructures::AccelerationStructures(AccelerationStructures&& other) noexcept {
  *this = std::move(other);
}

AccelerationStructures& AccelerationStructures::operator=(AccelerationStructures&& other) noexcept {
  if (this == &other) return *this;
  destroy();
  device_ = std::move(other.device_);
  structures_ = std::move(other.structures_);
  buffers_ = std::move(other.buffers_);
  return *this;
}

AccelerationStructures::~AccelerationStructures() {
  destroy();
}

void AccelerationStructures::destroy() {
  if (device_ && !device_->lost()) {
    for (const VkAccelerationStructureKHR handle : structures_) {
      device_->api().vkDestroyAccelerationStructureKHR(device_->handle(), handle, nullptr);
    }
  }
  structures_.clear();
  buffers_.clear();
  device_.reset();
}

std::uint64_t AccelerationStructures::bytes() const {
  std::uint64_t bytes = 0;
  for (const Buffer& buffer : buffers_) bytes += buffer.bytes();
  return bytes;
}

}  // namespace helio::vulkan
