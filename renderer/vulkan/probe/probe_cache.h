// What self-tests of devices have found, in the user's cache folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

// Results by device, driver, version of the self-test and fingerprint of the drivers' files, kept in the file
// vulkan-self-tests.json. A file that is missing, damaged or not readable is an empty cache, and one that cannot be
// written is left alone: then every probe tests anew.
class ProbeCache {
 public:
  // `folder` empty: there is no cache.
  ProbeCache(std::filesystem::path folder, std::uint64_t fingerprint);

  // The self-test's finding is "" where it passed, otherwise why it failed; absent where the device was not tested.
  std::optional<std::string> find(const DeviceInfo& device, Level level) const;
  void put(const DeviceInfo& device, Level level, const std::string& outcome);
  // Writes the file anew, in one step, if anything was put.
  void save() const;

 private:
  std::string key(const DeviceInfo& device, Level level) const;

  std::filesystem::path folder_;
  std::uint64_t fingerprint_;
  std::map<std::string, std::string> outcomes_;
  bool changed_ = false;
};

// The user's cache folder, $XDG_CACHE_HOME/heliograph or ~/.cache/heliograph; empty where neither variable is set to an
// absolute path.
std::filesystem::path default_cache_folder();

}  // namespace helio::vulkan
