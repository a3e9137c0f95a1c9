#include "renderer/vulkan/device/describe_device.h"

#include <algorithm>
#include <set>

#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

namespace {

std::string hexadecimal(const std::uint8_t (&bytes)[VK_UUID_SIZE]) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string version_text(std::uint32_t version) {
  return std::to_string(VK_API_VERSION_MAJOR(version)) + "." + std::to_string(VK_API_VERSION_MINOR(version)) + "." +
         std::to_string(VK_API_VERSION_PATCH(version));
}

const char* type_name(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    default:
      return "other";
  }
}

std::set<std::string> extension_names(VkPhysicalDevice physical) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> properties(count);
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, properties.data());
  properties.resize(count);
  std::set<std::string> names;
  for (const VkExtensionProperties& extension : properties) names.insert(extension.extensionName);
  return names;
}

int computing_family(VkPhysicalDevice physical) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
  for (std::uint32_t i = 0; i < count; ++i) {
    if (families[i].queueCount > 0 && (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT)) return static_cast<int>(i);
  }
  return -1;
}

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

struct NeededFeature {
  const char* name;
  VkBool32& value;
};

std::vector<NeededFeature> compute_features(DeviceFeatures& features) {
  return {{"bufferDeviceAddress", features.vulkan12.bufferDeviceAddress},
          {"scalarBlockLayout", features.vulkan12.scalarBlockLayout},
          {"shaderInt64", features.core.features.shaderInt64},
          {"shaderFloat64", features.core.features.shaderFloat64}};
}

std::vector<NeededFeature> ray_features(DeviceFeatures& features) {
  return {{"accelerationStructure", features.acceleration.accelerationStructure},
          {"rayTracingPipeline", features.ray_tracing.rayTracingPipeline}};
}

std::vector<std::string> missing(const std::vector<NeededFeature>& features) {
  std::vector<std::string> names;
  for (const NeededFeature& feature : features) {
    if (!feature.value) names.push_back(feature.name);
  }
  return names;
}

void read_level(VkPhysicalDevice physical, DescribedDevice& device) {
  DeviceInfo& info = device.info;
  DeviceFeatures features;
  vkGetPhysicalDeviceFeatures2(physical, &features.core);
  std::vector<std::string> lacks = missing(compute_features(features));
  if (device.queue_family < 0) lacks.insert(lacks.begin(), "a compute queue");
  if (!lacks.empty()) {
    info.reason = "the driver lacks " + join(lacks);
    return;
  }
  info.level = Level::compute;
  const std::set<std::string> extensions = extension_names(physical);
  for (const char* extension : device_extensions(Level::rt)) {
    if (!extensions.count(extension)) lacks.push_back(extension);
  }
  if (lacks.empty()) {
    DeviceFeatures with_rays;
    with_rays.link_ray_tracing();
    vkGetPhysicalDeviceFeatures2(physical, &with_rays.core);
    lacks = missing(ray_features(with_rays));
  }
  if (lacks.empty()) {
    info.level = Level::rt;
  } else {
    info.reason = "the driver lacks " + join(lacks);
  }
}

DescribedDevice describe(VkPhysicalDevice physical, int index) {
  DescribedDevice device;
  device.physical = physical;
  DeviceInfo& info = device.info;
  info.index = index;
  VkPhysicalDeviceProperties basic;
  vkGetPhysicalDeviceProperties(physical, &basic);
  info.name = basic.deviceName;
  info.type = type_name(basic.deviceType);
  info.driver_version = basic.driverVersion;
  info.api_version = version_text(basic.apiVersion);
  if (basic.apiVersion < VK_API_VERSION_1_2) {
    info.reason = "the driver has Vulkan " + info.api_version + "; needed: 1.2 or later";
    return device;
  }
  device.queue_family = computing_family(physical);
  read_level(physical, device);

  auto acceleration = vulkan_struct<VkPhysicalDeviceAccelerationStructurePropertiesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR);
  auto rays = vulkan_struct<VkPhysicalDeviceRayTracingPipelinePropertiesKHR>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR, &acceleration);
  auto allocation = vulkan_struct<VkPhysicalDeviceMaintenance3Properties>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES, info.level == Level::rt ? &rays : nullptr);
  auto ids = vulkan_struct<VkPhysicalDeviceIDProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES, &allocation);
  auto driver =
      vulkan_struct<VkPhysicalDeviceDriverProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES, &ids);
  auto properties = vulkan_struct<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver);
  vkGetPhysicalDeviceProperties2(physical, &properties);
  info.driver = driver.driverName;
  if (driver.driverInfo[0]) info.driver += std::string(", ") + driver.driverInfo;
  info.driver_uuid = hexadecimal(ids.driverUUID);
  info.device_uuid = hexadecimal(ids.deviceUUID);

  DeviceLimits& limits = info.limits;
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(physical, &memory);
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
      limits.heap_bytes = std::max<std::uint64_t>(limits.heap_bytes, memory.memoryHeaps[i].size);
  }
  limits.max_allocation_bytes = std::min<std::uint64_t>(limits.heap_bytes, allocation.maxMemoryAllocationSize);
  const VkPhysicalDeviceLimits& core = properties.properties.limits;
  limits.max_push_constant_bytes = core.maxPushConstantsSize;
  limits.max_group_invocations = core.maxComputeWorkGroupInvocations;
  std::copy_n(core.maxComputeWorkGroupSize, 3, limits.max_group_size);
  std::copy_n(core.maxComputeWorkGroupCount, 3, limits.max_group_count);
  limits.max_primitives = acceleration.maxPrimitiveCount;
  limits.max_instances = acceleration.maxInstanceCount;
  limits.max_rays = rays.maxRayDispatchInvocationCount;
  return device;
}

}  // namespace

DeviceFeatures::DeviceFeatures() {
  core.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  core.pNext = &vulkan12;
  vulkan12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
  acceleration.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR;
  ray_tracing.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR;
}

void DeviceFeatures::link_ray_tracing() {
  vulkan12.pNext = &acceleration;
  acceleration.pNext = &ray_tracing;
}

void enable_features(DeviceFeatures& features, Level level) {
  for (const NeededFeature& feature : compute_features(features)) feature.value = VK_TRUE;
  if (level != Level::rt) return;
  features.link_ray_tracing();
  for (const NeededFeature& feature : ray_features(features)) feature.value = VK_TRUE;
}

const std::vector<const char*>& device_extensions(Level level) {
  static const std::vector<const char*> none,
      rays = {VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME,
              VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME};
  return level == Level::rt ? rays : none;
}

Result<std::vector<DescribedDevice>> describe_devices(VkInstance instance) {
  std::uint32_t count = 0;
  VkResult result = vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> physical(count);
  if (result == VK_SUCCESS && count > 0) result = vkEnumeratePhysicalDevices(instance, &count, physical.data());
  if (result != VK_SUCCESS && result != VK_INCOMPLETE)
    return Error{ErrorCode::unavailable, "vkEnumeratePhysicalDevices failed with " + result_name(result), {}};
  std::vector<DescribedDevice> devices;
  for (std::uint32_t i = 0; i < count; ++i) devices.push_back(describe(physical[i], static_cast<int>(i)));
  return devices;
}

}  // namespace helio::vulkan
