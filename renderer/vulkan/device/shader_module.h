// SPIR-V as a Vulkan object, for as long as a pipeline is being made of it.
#pragma once

#include <volk.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

class ShaderModule {
 public:
  static Result<ShaderModule> create(std::shared_ptr<Device> device, std::span<const std::uint32_t> spirv);
  ShaderModule(ShaderModule&& other) noexcept;
  ShaderModule& operator=(ShaderModule&&) = delete;
  ~ShaderModule();

  VkShaderModule handle() const { return module_; }

 private:
  ShaderModule() = default;

  std::shared_ptr<Device> device_;
  VkShaderModule module_ = VK_NULL_HANDLE;
};

// The values of the specialisation constants 0, 1, ..., 32 bits each; refers to `values` until it is gone.
class Specialization {
 public:
  explicit Specialization(std::span<const std::uint32_t> values);
  Specialization(const Specialization&) = delete;
  const VkSpecializationInfo* info() const { return &info_; }

 private:
  std::vector<VkSpecializationMapEntry> entries_;
  VkSpecializationInfo info_{};
};

}  // namespace helio::vulkan
