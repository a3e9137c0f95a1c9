#include "renderer/vulkan/probe/probe_cache.h"

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "renderer/codec/atomic_file.h"
#include "renderer/vulkan/device/self_test/self_test.h"

namespace helio::vulkan {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "vulkan-self-tests.json";
constexpr std::uint64_t kLargestFile = 256 << 10;
constexpr std::size_t kMostOutcomes = 64, kLongestOutcome = 1000;

}  // namespace

fs::path default_cache_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return fs::path(value ? value : "");
  };
  if (const fs::path cache = variable("XDG_CACHE_HOME"); cache.is_absolute()) return cache / "heliograph";
  if (const fs::path home = variable("HOME"); home.is_absolute()) return home / ".cache/heliograph";
  return {};
}

ProbeCache::ProbeCache(fs::path folder, std::uint64_t fingerprint)
    : folder_(std::move(folder)), fingerprint_(fingerprint) {
  if (folder_.empty()) return;
  const auto bytes = read_whole_file((folder_ / kFile).string(), kLargestFile);
  if (!bytes) return;
  const auto json = nlohmann::json::parse(bytes->begin(), bytes->end(), nullptr, false);
  if (!json.is_object()) return;
  for (const auto& [key, outcome] : json.items()) {
    if (outcome.is_string() && outcomes_.size() < kMostOutcomes) outcomes_[key] = outcome.get<std::string>();
  }
}

std::string ProbeCache::key(const DeviceInfo& device, Level level) const {
  return device.device_uuid + " " + device.driver_uuid + " " + std::to_string(device.driver_version) + " " +
         device.driver + " " + device.name + " " + std::to_string(fingerprint_) + " " +
         std::to_string(kSelfTestVersion) + " " + std::string(level_name(level));
}

std::optional<std::string> ProbeCache::find(const DeviceInfo& device, Level level) const {
  const auto found = outcomes_.find(key(device, level));
  return found == outcomes_.end() ? std::nullopt : std::optional(found->second);
}

void ProbeCache::put(const DeviceInfo& device, Level level, const std::string& outcome) {
  if (outcomes_.size() >= kMostOutcomes) outcomes_.clear();
  outcomes_[key(device, level)] = outcome.substr(0, kLongestOutcome);
  changed_ = true;
}

void ProbeCache::save() const {
  if (folder_.empty() || !changed_) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  const std::string text = nlohmann::json(outcomes_).dump(1, ' ', true, nlohmann::json::error_handler_t::replace);
  (void)write_file_atomically((folder_ / kFile).string(),
                              {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace helio::vulkan
