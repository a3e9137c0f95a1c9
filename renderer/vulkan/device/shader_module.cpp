#include "renderer/vulkan/device/shader_module.h"

#include <string>
#include <utility>

#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

Result<ShaderModule> ShaderModule::create(std::shared_ptr<Device> device, std::span<const std::uint32_t> spirv) {
  auto create = vulkan_struct<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  create.codeSize = spirv.size_bytes();
  create.pCode = spirv.data();
  ShaderModule made;
  made.device_ = std::move(device);
  if (const VkResult result =
          made.device_->api().vkCreateShaderModule(made.device_->handle(), &create, nullptr, &made.module_);
      result != VK_SUCCESS) {
    return vulkan_error(*made.device_, result, "vkCreateShaderModule");
  }
  return made;
}

ShaderModule::ShaderModule(ShaderModule&& other) noexcept
    : device_(std::move(other.device_)), module_(std::exchange(other.module_, VK_NULL_HANDLE)) {}

ShaderModule::~ShaderModule() {
  if (device_ && !device_->lost()) device_->api().vkDestroyShaderModule(device_->handle(), module_, nullptr);
}

Specialization::Specialization(std::span<const std::uint32_t> values) {
  for (std::uint32_t i = 0; i < values.size(); ++i) entries_.push_back({i, i * 4, 4});
  info_ = {static_cast<std::uint32_t>(entries_.size()), entries_.data(), values.size_bytes(), values.data()};
}

}  // namespace helio::vulkan
