#include "renderer/trace/accel/traversal_isa.h"

#include <mutex>

#include "renderer/base/instruction_set.h"
#include "renderer/trace/accel/embree.h"

namespace helio {

namespace {

struct Choice {
  std::mutex mutex;
  std::string isa{kAutomaticIsa};
  RTCDevice device = nullptr;  // made by its first user
};

Choice& choice() {
  static Choice instance;
  return instance;
}

std::string isa_of(RTCDevice device, const std::string& chosen) {
  if (!device) return "none";
  if (chosen != kAutomaticIsa) return chosen;
  if (instruction_sets().empty()) return "neon";
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return "avx512";
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) {
    return processor_has("avx2") ? "avx2" : "avx";
  }
  return processor_has("sse4.2") ? "sse4.2" : "sse2";
}

RTCDevice make_device(const std::string& isa) {
  std::string config = "start_threads=0,set_affinity=0";
  if (isa != kAutomaticIsa) config.append(",isa=").append(isa == "sse4.2" ? "sse42" : isa);
  return rtcNewDevice(config.c_str());
}

}  // namespace

RTCDevice embree::device() {
  Choice& c = choice();
  const std::lock_guard lock(c.mutex);
  if (!c.device) c.device = make_device(c.isa);
  return c.device;
}

Status choose_traversal_isa(const std::string& isa) {
  if (const std::string problem = isa_problem(isa); !problem.empty()) {
    return Error{ErrorCode::invalid_argument, problem, "isa"};
  }
  if (isa == kAutomaticIsa) return ok_status();
  Choice& c = choice();
  const std::lock_guard lock(c.mutex);
  if (c.device && isa_of(c.device, c.isa) != isa) {
    std::string message = isa;
    message.append(" was asked for after this process had begun with ").append(isa_of(c.device, c.isa));
    return Error{ErrorCode::failed_precondition, message, "isa"};
  }
  c.isa = isa;
  return ok_status();
}

std::string traversal_isa() {
  const RTCDevice device = embree::device();
  Choice& c = choice();
  const std::lock_guard lock(c.mutex);
  return isa_of(device, c.isa);
}

std::string embree_version() {
  const RTCDevice device = embree::device();
  if (!device) return "unknown";
  std::string version;
  for (const RTCDeviceProperty part :
       {RTC_DEVICE_PROPERTY_VERSION_MAJOR, RTC_DEVICE_PROPERTY_VERSION_MINOR, RTC_DEVICE_PROPERTY_VERSION_PATCH}) {
    if (!version.empty()) version += '.';
    version += std::to_string(rtcGetDeviceProperty(device, part));
  }
  return version;
}

}  // namespace helio
