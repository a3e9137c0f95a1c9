// The files that Vulkan's drivers consist of.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace helio::vulkan {

// The manifests that the loader reads, from VK_DRIVER_FILES, VK_ICD_FILENAMES, VK_ADD_DRIVER_FILES or its standard
// folders, and the libraries that they name, where they are found; sorted, at most some hundred.
std::vector<std::filesystem::path> driver_files();

// A number that changes when a driver is installed, removed or replaced, and with the environment variables that choose
// drivers or change the code that software drivers generate.
std::uint64_t driver_fingerprint();

}  // namespace helio::vulkan
