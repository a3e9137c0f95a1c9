// A library with the symbols of Open Image Denoise that we call, whose "network" is a formula: output = color / 2 +
// albedo / 4 + |normal| / 8. What else it does is said by words of the environment's HELIO_FAKE_OIDN at each call:
//   version=N, type=N  of the device
//   fail               executing ends with an error
//   slow               executing takes ten seconds, asking the monitor every few milliseconds
// With HELIO_FAKE_OIDN_1 it is a version 1, which names functions differently.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>

namespace {

struct Image {
  float* pixels = nullptr;
  std::size_t width = 0, height = 0;
};
struct Device {
  int error = 0;
  bool committed = false;
  std::string text;
};
struct Filter {
  Device* device = nullptr;
  std::map<std::string, Image> images;
  bool hdr = false, committed = false;
  bool (*monitor)(void*, double) = nullptr;
  void* user = nullptr;
};

std::string said() {
  const char* text = std::getenv("HELIO_FAKE_OIDN");
  return text ? text : "";
}
int number(const std::string& name, int otherwise) {
  const std::string text = said();
  const std::size_t at = text.find(name + "=");
  return at == std::string::npos ? otherwise : std::atoi(text.c_str() + at + name.size() + 1);
}
void fail(Device* device, int error, const char* text) {
  device->error = error;
  device->text = text;
}

}  // namespace

#define FAKE __attribute__((visibility("default")))

extern "C" {

FAKE void* oidnNewDevice(int) {
  return new Device;
}
FAKE void oidnReleaseDevice(void* device) {
  delete static_cast<Device*>(device);
}

#ifdef HELIO_FAKE_OIDN_1

FAKE int oidnGetDevice1i(void*, const char* name) {
  return std::strcmp(name, "version") == 0 ? number("version", 10403) : 0;
}

#else

FAKE void oidnSetDeviceBool(void*, const char*, bool) {}
FAKE void oidnSetDeviceInt(void*, const char*, int) {}
FAKE int oidnGetDeviceInt(void*, const char* name) {
  return std::strcmp(name, "version") == 0 ? number("version", 20501) : number("type", 1);
}
FAKE void oidnCommitDevice(void* device) {
  static_cast<Device*>(device)->committed = true;
}
FAKE int oidnGetDeviceError(void* handle, const char** message) {
  static thread_local std::string told;
  auto* device = static_cast<Device*>(handle);
  if (!device) return 0;
  const int error = device->error;
  told = device->text;
  if (message) *message = error ? told.c_str() : nullptr;
  device->error = 0;
  return error;
}
FAKE void* oidnNewFilter(void* device, const char* type) {
  if (std::strcmp(type, "RT") != 0) return nullptr;
  auto* filter = new Filter;
  filter->device = static_cast<Device*>(device);
  return filter;
}
FAKE void oidnSetSharedFilterImage(void* filter, const char* name, void* pixels, int format, std::size_t width,
                                   std::size_t height, std::size_t, std::size_t, std::size_t) {
  if (format == 3) static_cast<Filter*>(filter)->images[name] = {static_cast<float*>(pixels), width, height};
}
FAKE void oidnSetFilterBool(void* filter, const char* name, bool value) {
  if (std::strcmp(name, "hdr") == 0) static_cast<Filter*>(filter)->hdr = value;
}
FAKE void oidnSetFilterInt(void*, const char*, int) {}
FAKE void oidnSetFilterProgressMonitorFunction(void* filter, bool (*monitor)(void*, double), void* user) {
  static_cast<Filter*>(filter)->monitor = monitor;
  static_cast<Filter*>(filter)->user = user;
}
FAKE void oidnCommitFilter(void* handle) {
  auto* filter = static_cast<Filter*>(handle);
  filter->committed = filter->device->committed && filter->hdr && filter->images.size() == 4;
}
FAKE void oidnExecuteFilter(void* handle) {
  auto* filter = static_cast<Filter*>(handle);
  if (!filter->committed) return fail(filter->device, 3, "the filter is not committed");
  const Image color = filter->images["color"], albedo = filter->images["albedo"], normal = filter->images["normal"],
              output = filter->images["output"];
  const std::size_t floats = 3 * color.width * color.height;
  for (std::size_t i = 0; i < floats / 2; ++i) output.pixels[i] = -1;
  const int steps = said().find("slow") == std::string::npos ? 1 : 2000;
  for (int step = 0; step < steps; ++step) {
    if (filter->monitor && !filter->monitor(filter->user, double(step) / steps))
      return fail(filter->device, 6, "execution was cancelled");
    if (steps > 1) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (said().find("fail") != std::string::npos) return fail(filter->device, 4, "a failure by request");
  for (std::size_t i = 0; i < floats; ++i)
    output.pixels[i] = color.pixels[i] / 2 + albedo.pixels[i] / 4 + std::fabs(normal.pixels[i]) / 8;
}
FAKE void oidnReleaseFilter(void* filter) {
  delete static_cast<Filter*>(filter);
}

#endif
}
