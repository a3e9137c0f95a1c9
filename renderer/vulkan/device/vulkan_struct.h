// Vulkan's structures, zero but for their type.
#pragma once

#include <volk.h>

namespace helio::vulkan {

template <class T>
T vulkan_struct(VkStructureType type, void* next = nullptr) {
  T made{};
  made.sType = type;
  made.pNext = next;
  return made;
}

}  // namespace helio::vulkan
