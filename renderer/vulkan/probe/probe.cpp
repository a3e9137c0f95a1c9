#include "renderer/vulkan/probe/probe.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "renderer/vulkan/probe/child_process.h"
#include "renderer/vulkan/probe/device_json.h"
#include "renderer/vulkan/probe/driver_files.h"
#include "renderer/vulkan/probe/probe_cache.h"

namespace helio::vulkan {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Read = ChildProcess::Read;

constexpr const char* kProgram = "heliograph-vulkan-probe";
constexpr std::chrono::milliseconds kStopLatency{100};

struct Test {
  std::size_t device;  // of the list
  Level level;
};

std::string seconds(std::chrono::milliseconds limit) {
  return limit.count() % 1000 == 0 ? std::to_string(limit.count() / 1000) + " s"
                                   : std::to_string(limit.count()) + " ms";
}

// One probe: from the start of the program to the end of its tests, or to its crash.
class Probing {
 public:
  Probing(const ProbeOptions& options, ChildProcess::Time deadline) : options_(options), deadline_(deadline) {}

  // Lists the devices. An error: there is no list, and why.
  Result<std::vector<DeviceInfo>> list(ChildProcess& child) const {
    std::string line;
    const Read read = this->read(child, line);
    if (read == Read::late) return Error{ErrorCode::unavailable, "the drivers gave " + no_answer(), {}};
    if (read == Read::end) return Error{ErrorCode::unavailable, "the probe of Vulkan devices " + ended(child), {}};
    const json message = read == Read::line ? json::parse(line, nullptr, false) : json();
    if (message.is_object() && message.contains("error") && message["error"].is_string())
      return Error{ErrorCode::unavailable, message["error"].get<std::string>(), {}};
    if (!message.is_object() || !message.contains("devices") || !message["devices"].is_array()) return misunderstood();
    std::vector<DeviceInfo> devices;
    for (const json& each : message["devices"]) {
      auto device = device_from_json(each);
      if (!device || device->index != static_cast<int>(devices.size())) return misunderstood();
      devices.push_back(std::move(*device));
    }
    if (devices.empty()) return Error{ErrorCode::not_found, "the Vulkan drivers find no device", {}};
    return devices;
  }

  bool late() const { return late_; }  // something had no answer

  struct Outcome {
    std::string failure;   // "": passed
    bool lasting = false;  // the next probe would find the same
  };

  // The outcomes of the first of the tests, in their order; fewer than all where the program ended early.
  std::vector<Outcome> run(ChildProcess& child, const std::vector<DeviceInfo>& devices,
                           const std::vector<Test>& tests) const {
    json request = json::array();
    for (const Test& test : tests)
      request.push_back({static_cast<unsigned>(devices[test.device].index), level_name(test.level)});
    std::vector<Outcome> outcomes;
    child.write_line(json{{"test", request}}.dump(), deadline_);
    while (outcomes.size() < tests.size()) {
      std::string begin, line;
      Read read = this->read(child, begin);
      if (read == Read::line) read = this->read(child, line);
      const json message = read == Read::line ? json::parse(line, nullptr, false) : json();
      if (read == Read::late) {
        outcomes.push_back({no_answer(), false});
        return outcomes;
      }
      if (read == Read::end) {
        const std::string how = ended(child);
        outcomes.push_back({"the driver " + how, how.starts_with("crashed (SIG") && how != "crashed (SIGKILL)"});
        return outcomes;
      }
      if (!message.is_object() || !message.contains("outcome") || !message["outcome"].is_string()) {
        outcomes.push_back({misunderstood().message, false});
        return outcomes;
      }
      const auto failure = message["outcome"].get<std::string>();
      outcomes.push_back({failure, failure.empty()});  // a failure may be for want of memory
    }
    return outcomes;
  }

 private:
  // Reads a line, until the deadline or until the caller wants no answer any more.
  Read read(ChildProcess& child, std::string& line) const {
    for (;;) {
      const auto now = std::chrono::steady_clock::now();
      const Read read = child.read_line(line, std::min(deadline_, now + kStopLatency));
      if (read != Read::late) return read;
      if (std::chrono::steady_clock::now() >= deadline_ || (options_.stop && *options_.stop)) {
        late_ = true;
        return read;
      }
    }
  }
  std::string no_answer() const { return "no answer within " + seconds(options_.time_limit); }
  std::string ended(ChildProcess& child) const {
    const std::string how = child.finish(deadline_);
    return how.empty() ? "ended without an answer" : how;
  }
  static Error misunderstood() {
    return {
        ErrorCode::internal, std::string(kProgram) + " answers what is not understood; is it of another version?", {}};
  }

  const ProbeOptions& options_;
  ChildProcess::Time deadline_;
  mutable bool late_ = false;
};

// Lowers the device to the level before `level`, whose self-test failed.
void refuse(DeviceInfo& device, Level level, const std::string& why) {
  device.level = level == Level::rt ? Level::compute : Level::none;
  device.reason = "the self-test of " + std::string(level_name(level)) + " failed: " + why;
}

// Judges a device by the cache where that knows it, and otherwise adds what has to be tested. Compute comes first: a
// device that fails it has no level at all.
void judge(DeviceInfo& device, std::size_t position, const ProbeCache& cache, std::vector<Test>& compute,
           std::vector<Test>& rays) {
  for (const Level level : {Level::compute, Level::rt}) {
    if (device.level < level) return;
    const auto known = cache.find(device, level);
    if (!known) {
      (level == Level::compute ? compute : rays).push_back({position, level});
    } else if (!known->empty()) {
      refuse(device, level, *known);
      return;
    }
  }
}

Result<fs::path> find_program() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return Error{ErrorCode::not_found, "/proc/self/exe: " + error.message(), {}};
  const fs::path folder = self.parent_path();
  for (const fs::path& place : {folder / kProgram, folder.parent_path() / "libexec/heliograph" / kProgram}) {
    if (fs::exists(place, error)) return place;
  }
  return Error{ErrorCode::not_found,
               std::string(kProgram) + " is neither in " + folder.string() + " nor in " +
                   (folder.parent_path() / "libexec/heliograph").string(),
               {}};
}

// Lists and tests the devices; sets `late` where an answer did not come in time.
Result<std::vector<DeviceInfo>> probe(const ProbeOptions& options, bool& late) {
  const ChildProcess::Time deadline = std::chrono::steady_clock::now() + options.time_limit;
  fs::path program = options.program;
  if (program.empty()) {
    auto found = find_program();
    if (!found) return std::move(found).error();
    program = std::move(found).value();
  }
  ProbeCache cache(options.cache_folder.empty() ? default_cache_folder() : options.cache_folder, driver_fingerprint());
  const Probing probing(options, deadline);

  std::vector<DeviceInfo> devices;
  std::vector<Test> waiting;
  for (bool first = true; first || !waiting.empty(); first = false) {
    auto child = ChildProcess::start(program);
    if (!child) return std::move(child).error();
    auto listed = probing.list(*child);
    late = probing.late();
    if (first) {
      if (!listed) return std::move(listed).error();
      devices = std::move(listed).value();
      std::vector<Test> rays;
      for (std::size_t i = 0; i < devices.size(); ++i) judge(devices[i], i, cache, waiting, rays);
      waiting.insert(waiting.end(), rays.begin(), rays.end());
      if (waiting.empty()) break;
    } else if (!listed) {  // no time was left, or the drivers answer differently now
      for (const Test& test : waiting) {
        if (devices[test.device].level >= test.level) refuse(devices[test.device], test.level, listed.error().message);
      }
      break;
    }
    const auto outcomes = probing.run(*child, devices, waiting);
    late = probing.late();
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      DeviceInfo& device = devices[waiting[i].device];
      if (outcomes[i].lasting) cache.put(device, waiting[i].level, outcomes[i].failure);
      if (!outcomes[i].failure.empty() && device.level >= waiting[i].level)
        refuse(device, waiting[i].level, outcomes[i].failure);
    }
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(outcomes.size()));
  }
  cache.save();
  return devices;
}

}  // namespace

DeviceList probe_devices(const ProbeOptions& options) {
  bool late = false;
  auto devices = probe(options, late);
  if (devices) return {std::move(devices).value(), {}, late};
  return {{}, std::move(devices).error().to_string(), late};
}

}  // namespace helio::vulkan
