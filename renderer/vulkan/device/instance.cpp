#include "renderer/vulkan/device/instance.h"

#include <mutex>
#include <string>
#include <vector>

#include "renderer/vulkan/device/device.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::mutex g_mutex;
bool g_functions_loaded = false;
VkInstance g_instances[2] = {};  // [validation]

std::mutex g_messages_mutex;
int g_messages = 0;
std::string g_first_message;

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
  const std::lock_guard lock(g_messages_mutex);
  if (g_messages++ == 0) g_first_message = data->pMessage ? data->pMessage : "";
  return VK_FALSE;
}

Error no_instance(VkResult result, bool validation) {
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
    return {ErrorCode::unavailable, "the Vulkan loader finds no driver (on Debian: mesa-vulkan-drivers)", {}};
  if (validation && (result == VK_ERROR_LAYER_NOT_PRESENT || result == VK_ERROR_EXTENSION_NOT_PRESENT))
    return {ErrorCode::unavailable, "there is no VK_LAYER_KHRONOS_validation (on Debian: vulkan-validationlayers)", {}};
  return {ErrorCode::unavailable, "vkCreateInstance failed with " + result_name(result), {}};
}

}  // namespace

Result<VkInstance> open_instance(bool validation) {
  const std::lock_guard lock(g_mutex);
  VkInstance& instance = g_instances[validation];
  if (instance) return instance;
  if (volkInitialize() != VK_SUCCESS)
    return Error{ErrorCode::unavailable, "there is no Vulkan loader, libvulkan.so.1 (on Debian: libvulkan1)", {}};
  if (volkGetInstanceVersion() < VK_API_VERSION_1_1)
    return Error{ErrorCode::unavailable, "the Vulkan loader speaks Vulkan 1.0 only; needed: 1.1 or later", {}};

  auto application = vulkan_struct<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "heliograph";
  application.apiVersion = VK_API_VERSION_1_2;
  auto messages =
      vulkan_struct<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  messages.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messages.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  messages.pfnUserCallback = keep_message;
  const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  auto features = vulkan_struct<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = &synchronization;
  features.pNext = &messages;
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  auto create = vulkan_struct<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  create.pApplicationInfo = &application;
  if (validation) {
    create.pNext = &features;
    create.enabledLayerCount = 1;
    create.ppEnabledLayerNames = &kValidationLayer;
    create.enabledExtensionCount = 1;
    create.ppEnabledExtensionNames = &extension;
  }
  VkInstance created = VK_NULL_HANDLE;
  if (const VkResult result = vkCreateInstance(&create, nullptr, &created); result != VK_SUCCESS)
    return no_instance(result, validation);
  // The loader's functions serve every instance, so those of the first are kept: other threads may be calling them.
  if (!g_functions_loaded) volkLoadInstanceOnly(created);
  g_functions_loaded = true;
  if (validation) {
    const auto create_messenger = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(created, "vkCreateDebugUtilsMessengerEXT"));
    VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
    if (create_messenger) create_messenger(created, &messages, nullptr, &messenger);  // lives as long as the instance
  }
  instance = created;
  return created;
}

int validation_message_count() {
  const std::lock_guard lock(g_messages_mutex);
  return g_messages;
}

std::string first_validation_message() {
  const std::lock_guard lock(g_messages_mutex);
  return g_first_message;
}

}  // namespace helio::vulkan
