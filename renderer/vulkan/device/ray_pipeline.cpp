#include "renderer/vulkan/device/ray_pipeline.h"

#include <cstring>
#include <string>
#include <utility>

#include "renderer/vulkan/device/shader_module.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

namespace {

constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_RAYGEN_BIT_KHR | VK_SHADER_STAGE_MISS_BIT_KHR |
                                       VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR | VK_SHADER_STAGE_ANY_HIT_BIT_KHR |
                                       VK_SHADER_STAGE_INTERSECTION_BIT_KHR;

std::uint64_t align_up(std::uint64_t value, std::uint64_t alignment) {
  return (value + alignment - 1) / alignment * alignment;
}

// The stages and groups of a pipeline, in the order raygen, miss, hit groups.
class Stages {
 public:
  Stages(std::shared_ptr<Device> device, const VkSpecializationInfo* constants)
      : device_(std::move(device)), constants_(constants) {}

  Status add_general(Spirv spirv, VkShaderStageFlagBits stage) {
    const auto index = add(spirv, stage);
    if (!index) return index.error();
    groups_.push_back(group(VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR));
    groups_.back().generalShader = *index;
    return ok_status();
  }

  Status add_hit_group(const RayShaders::HitGroup& shaders) {
    const auto closest = add(shaders.closest_hit, VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR);
    if (!closest) return closest.error();
    const auto any = add(shaders.any_hit, VK_SHADER_STAGE_ANY_HIT_BIT_KHR);
    if (!any) return any.error();
    const auto intersection = add(shaders.intersection, VK_SHADER_STAGE_INTERSECTION_BIT_KHR);
    if (!intersection) return intersection.error();
    groups_.push_back(group(shaders.intersection.empty() ? VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR
                                                         : VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR));
    groups_.back().closestHitShader = *closest;
    groups_.back().anyHitShader = *any;
    groups_.back().intersectionShader = *intersection;
    return ok_status();
  }

  const std::vector<VkPipelineShaderStageCreateInfo>& stages() const { return stages_; }
  const std::vector<VkRayTracingShaderGroupCreateInfoKHR>& groups() const { return groups_; }

 private:
  static VkRayTracingShaderGroupCreateInfoKHR group(VkRayTracingShaderGroupTypeKHR type) {
    return {VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR,
            nullptr,
            type,
            VK_SHADER_UNUSED_KHR,
            VK_SHADER_UNUSED_KHR,
            VK_SHADER_UNUSED_KHR,
            VK_SHADER_UNUSED_KHR,
            nullptr};
  }

  Result<std::uint32_t> add(Spirv spirv, VkShaderStageFlagBits stage) {
    if (spirv.empty()) return VK_SHADER_UNUSED_KHR;
    auto module = ShaderModule::create(device_, spirv);
    if (!module) return std::move(module).error();
    modules_.push_back(std::move(module).value());
    auto create = vulkan_struct<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    create.stage = stage;
    create.module = modules_.back().handle();
    create.pName = "main";
    create.pSpecializationInfo = constants_;
    stages_.push_back(create);
    return static_cast<std::uint32_t>(stages_.size() - 1);
  }

  std::shared_ptr<Device> device_;
  const VkSpecializationInfo* constants_;
  std::vector<ShaderModule> modules_;
  std::vector<VkPipelineShaderStageCreateInfo> stages_;
  std::vector<VkRayTracingShaderGroupCreateInfoKHR> groups_;
};

}  // namespace

Result<RayPipeline> RayPipeline::create(std::shared_ptr<Device> device, const RayShaders& shaders,
                                        std::uint32_t push_bytes, std::span<const std::uint32_t> constants,
                                        std::uint32_t recursion) {
  HELIO_CHECK(device->level() == Level::rt && recursion >= 1);
  if (device->lost()) return device->lost_error();
  const RayPipelineLimits& limits = device->ray_limits();
  if (recursion > limits.max_recursion) {
    return Error{ErrorCode::failed_precondition,
                 "recursion depth " + std::to_string(recursion) + "; " + device->info().name + " allows at most " +
                     std::to_string(limits.max_recursion),
                 {}};
  }
  const Specialization specialization(constants);
  Stages stages(device, specialization.info());
  Status added = stages.add_general(shaders.raygen, VK_SHADER_STAGE_RAYGEN_BIT_KHR);
  for (const Spirv& miss : shaders.miss) {
    if (added) added = stages.add_general(miss, VK_SHADER_STAGE_MISS_BIT_KHR);
  }
  for (const RayShaders::HitGroup& hit : shaders.hit_groups) {
    if (added) added = stages.add_hit_group(hit);
  }
  if (!added) return std::move(added).error();

  auto objects = PipelineObjects::create(device, push_bytes, kStages);
  if (!objects) return std::move(objects).error();
  auto create =
      vulkan_struct<VkRayTracingPipelineCreateInfoKHR>(VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR);
  create.stageCount = static_cast<std::uint32_t>(stages.stages().size());
  create.pStages = stages.stages().data();
  create.groupCount = static_cast<std::uint32_t>(stages.groups().size());
  create.pGroups = stages.groups().data();
  create.maxPipelineRayRecursionDepth = recursion;
  create.layout = (*objects)->layout;
  const VolkDeviceTable& api = device->api();
  if (const VkResult result = api.vkCreateRayTracingPipelinesKHR(device->handle(), VK_NULL_HANDLE, VK_NULL_HANDLE, 1,
                                                                 &create, nullptr, &(*objects)->pipeline);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateRayTracingPipelinesKHR");
  }

  // The shader binding table: raygen, miss, hit, each part aligned.
  std::vector<std::byte> handles(stages.groups().size() * limits.handle_size);
  if (const VkResult result = api.vkGetRayTracingShaderGroupHandlesKHR(
          device->handle(), (*objects)->pipeline, 0, create.groupCount, handles.size(), handles.data());
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkGetRayTracingShaderGroupHandlesKHR");
  }
  const std::uint64_t stride = align_up(limits.handle_size, limits.handle_alignment);
  const std::uint64_t counts[] = {1, shaders.miss.size(), shaders.hit_groups.size()};
  std::uint64_t sizes[3], bytes = 0;
  for (int part = 0; part < 3; ++part) bytes += sizes[part] = align_up(counts[part] * stride, limits.base_alignment);
  auto table = Buffer::create(device, bytes + limits.base_alignment, Memory::host, "a shader binding table",
                              VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR);
  if (!table) return std::move(table).error();
  RayPipeline made;
  made.objects_ = std::move(*objects);
  made.table_ = std::move(table).value();
  const std::uint64_t begin = align_up(made.table_.address(), limits.base_alignment);
  VkStridedDeviceAddressRegionKHR* const regions[] = {&made.raygen_, &made.miss_, &made.hit_};
  const std::byte* handle = handles.data();
  std::uint64_t address = begin;
  for (int part = 0; part < 3; ++part) {
    for (std::uint64_t i = 0; i < counts[part]; ++i, handle += limits.handle_size)
      std::memcpy(&made.table_.mapped()[address - made.table_.address() + i * stride], handle, limits.handle_size);
    // The raygen region has the size of its stride, as Vulkan demands.
    if (counts[part] > 0) *regions[part] = {address, stride, part == 0 ? stride : counts[part] * stride};
    address += sizes[part];
  }
  return made;
}

void RayPipeline::trace(VkCommandBuffer commands, std::span<const std::byte> push, std::uint32_t width,
                        std::uint32_t height) const {
  objects_->bind(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, push);
  objects_->device->api().vkCmdTraceRaysKHR(commands, &raygen_, &miss_, &hit_, &callable_, width, height, 1);
}

}  // namespace helio::vulkan
