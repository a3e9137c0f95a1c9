#include "renderer/film/display/oidn_library.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/base/check.h"

namespace helio {

namespace {

// Handles and numbers of the C API, as version 2 has them.
using Device = void*;
using Filter = void*;
using Monitor = bool (*)(void* user, double done);

constexpr int kDeviceCpu = 1, kFloat3 = 3, kErrorNone = 0, kErrorCancelled = 6;
constexpr int kMajor = 2;

constexpr const char* kAllowed = "allowed: libOpenImageDenoise.so of Open Image Denoise 2.x, with its processor device";

// Of the filter's memory, from which on it works in tiles.
constexpr std::size_t kMostScratch = 512u << 20;
// As measured of 2.5.1, rounded up: of the network in one tile | of the picture between tiles | whatever the size.
constexpr std::size_t kNetworkPerPixel = 640, kTiledPerPixel = 16, kWeights = 24u << 20;

}  // namespace

struct OidnFunctions {
  Device (*oidnNewDevice)(int type) = nullptr;
  void (*oidnSetDeviceBool)(Device, const char* name, bool value) = nullptr;
  void (*oidnSetDeviceInt)(Device, const char* name, int value) = nullptr;
  int (*oidnGetDeviceInt)(Device, const char* name) = nullptr;
  void (*oidnCommitDevice)(Device) = nullptr;
  int (*oidnGetDeviceError)(Device, const char** message) = nullptr;
  void (*oidnReleaseDevice)(Device) = nullptr;
  Filter (*oidnNewFilter)(Device, const char* type) = nullptr;
  void (*oidnSetSharedFilterImage)(Filter, const char* name, void* pixels, int format, std::size_t width,
                                   std::size_t height, std::size_t byte_offset, std::size_t pixel_stride,
                                   std::size_t row_stride) = nullptr;
  void (*oidnSetFilterBool)(Filter, const char* name, bool value) = nullptr;
  void (*oidnSetFilterInt)(Filter, const char* name, int value) = nullptr;
  void (*oidnSetFilterProgressMonitorFunction)(Filter, Monitor, void* user) = nullptr;
  void (*oidnCommitFilter)(Filter) = nullptr;
  void (*oidnExecuteFilter)(Filter) = nullptr;
  void (*oidnReleaseFilter)(Filter) = nullptr;
};

namespace {

template <class Function>
bool resolve(void* handle, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(handle, name));
  return function != nullptr;
}

// The first symbol that the library lacks; null: none.
const char* resolve_all(void* handle, OidnFunctions& f) {
#define HELIO_OIDN_SYMBOL(name) \
  if (!resolve(handle, #name, f.name)) return #name
  HELIO_OIDN_SYMBOL(oidnNewDevice);
  HELIO_OIDN_SYMBOL(oidnSetDeviceBool);
  HELIO_OIDN_SYMBOL(oidnSetDeviceInt);
  HELIO_OIDN_SYMBOL(oidnGetDeviceInt);
  HELIO_OIDN_SYMBOL(oidnCommitDevice);
  HELIO_OIDN_SYMBOL(oidnGetDeviceError);
  HELIO_OIDN_SYMBOL(oidnReleaseDevice);
  HELIO_OIDN_SYMBOL(oidnNewFilter);
  HELIO_OIDN_SYMBOL(oidnSetSharedFilterImage);
  HELIO_OIDN_SYMBOL(oidnSetFilterBool);
  HELIO_OIDN_SYMBOL(oidnSetFilterInt);
  HELIO_OIDN_SYMBOL(oidnSetFilterProgressMonitorFunction);
  HELIO_OIDN_SYMBOL(oidnCommitFilter);
  HELIO_OIDN_SYMBOL(oidnExecuteFilter);
  HELIO_OIDN_SYMBOL(oidnReleaseFilter);
#undef HELIO_OIDN_SYMBOL
  return nullptr;
}

Error refusal(ErrorCode code, const std::string& path, const std::string& what) {
  return {code, "'" + path + "' " + what + "; " + kAllowed, {}};
}

std::string version_text(int version) {
  return std::to_string(version / 10000) + '.' + std::to_string(version / 100 % 100) + '.' +
         std::to_string(version % 100);
}

// "" unless it is a version 1, which names these two differently.
std::string old_version(void* handle) {
  Device (*new_device)(int) = nullptr;
  int (*get_int)(Device, const char*) = nullptr;
  void (*release)(Device) = nullptr;
  if (!resolve(handle, "oidnGetDevice1i", get_int) || !resolve(handle, "oidnNewDevice", new_device) ||
      !resolve(handle, "oidnReleaseDevice", release))
    return "";
  const Device device = new_device(kDeviceCpu);
  if (!device) return "";
  const int version = get_int(device, "version");
  release(device);
  return version / 10000 == kMajor ? "" : version_text(version);
}

// What the device has to say about the calls since it was last asked.
struct DeviceError {
  int code = kErrorNone;
  std::string text;
};
DeviceError last_error(const OidnFunctions& f, Device device) {
  const char* text = nullptr;
  const int code = f.oidnGetDeviceError(device, &text);
  return {code, text && *text ? text : "error " + std::to_string(code)};
}

// A committed device of the processor's, and the filter on it.
class Session {
 public:
  Session(const OidnFunctions& functions, int threads) : f_(functions), device_(f_.oidnNewDevice(kDeviceCpu)) {
    if (!device_) return;
    f_.oidnSetDeviceBool(device_, "setAffinity", false);  // the threads are shared with what renders
    if (threads > 0) f_.oidnSetDeviceInt(device_, "numThreads", threads);
    f_.oidnCommitDevice(device_);
  }
  ~Session() {
    if (filter_) f_.oidnReleaseFilter(filter_);
    if (device_) f_.oidnReleaseDevice(device_);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  Device device() const { return device_; }
  DeviceError error() const { return last_error(f_, device_); }
  Filter make_filter() { return filter_ = f_.oidnNewFilter(device_, "RT"); }

 private:
  const OidnFunctions& f_;
  const Device device_;
  Filter filter_ = nullptr;
};

// Of a thread of the library's. False: give up.
bool go_on(void* user, double) {
  return !static_cast<const CancelToken*>(user)->cancelled();
}

}  // namespace

OidnLibrary::OidnLibrary(std::string path, int threads) : path_(std::move(path)), threads_(threads) {}
OidnLibrary::~OidnLibrary() = default;

Result<std::shared_ptr<const OidnLibrary>> OidnLibrary::load(const std::string& path, int threads) {
  void* const handle = path.empty() ? nullptr : dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    // "PATH: cannot open shared object file: ...".
    const char* const said = path.empty() ? nullptr : dlerror();
    std::string reason = said ? said : "the path is empty";
    if (reason.rfind(path + ": ", 0) == 0 && !path.empty()) reason = reason.substr(path.size() + 2);
    return refusal(ErrorCode::not_found, path, "cannot be loaded (" + reason + ")");
  }
  auto functions = std::make_unique<OidnFunctions>();
  if (const char* const missing = resolve_all(handle, *functions)) {
    const std::string version = old_version(handle);
    dlclose(handle);
    if (!version.empty()) return refusal(ErrorCode::failed_precondition, path, "is Open Image Denoise " + version);
    return refusal(ErrorCode::failed_precondition, path, std::string("lacks the symbol ") + missing);
  }
  std::shared_ptr<OidnLibrary> library(new OidnLibrary(path, threads));
  library->functions_ = std::move(functions);
  // From here on it may have threads, and is not closed again.
  if (const Status usable = library->check_device(); !usable) return usable.error();
  return std::shared_ptr<const OidnLibrary>(std::move(library));
}

Status OidnLibrary::check_device() {
  const Session session(*functions_, threads_);
  const DeviceError error = session.device() ? session.error() : last_error(*functions_, nullptr);
  if (!session.device() || error.code != kErrorNone)
    return refusal(ErrorCode::failed_precondition, path_, "has no usable processor device (" + error.text + ")");
  const int version = functions_->oidnGetDeviceInt(session.device(), "version");
  version_ = version_text(version);
  if (version / 10000 != kMajor)
    return refusal(ErrorCode::failed_precondition, path_, "is Open Image Denoise " + version_);
  const int type = functions_->oidnGetDeviceInt(session.device(), "type");
  if (type != kDeviceCpu)
    return refusal(ErrorCode::failed_precondition, path_,
                   "gives a device of type " + std::to_string(type) + " where the processor's is asked for");
  return ok_status();
}

Status OidnLibrary::denoise(const Images& images, const CancelToken* cancel) const {
  HELIO_DCHECK(images.width > 0 && images.height > 0);
  const OidnFunctions& f = *functions_;
  Session session(f, threads_);
  const auto failed = [](const DeviceError& error) {
    if (error.code == kErrorCancelled) return Error{ErrorCode::cancelled, "denoising was given up", {}};
    return Error{ErrorCode::internal, "Open Image Denoise: " + error.text, {}};
  };
  if (!session.device()) return failed(last_error(f, nullptr));
  const Filter filter = session.make_filter();
  if (!filter) return failed(session.error());
  // The inputs are only read.
  const auto set = [&](const char* name, const float* pixels) {
    f.oidnSetSharedFilterImage(filter, name, const_cast<float*>(pixels), kFloat3, std::size_t(images.width),
                               std::size_t(images.height), 0, 0, 0);
  };
  set("color", images.color);
  set("albedo", images.albedo);
  set("normal", images.normal);
  set("output", images.output);
  f.oidnSetFilterBool(filter, "hdr", true);
  f.oidnSetFilterInt(filter, "maxMemoryMB", int(kMostScratch >> 20));
  if (cancel) f.oidnSetFilterProgressMonitorFunction(filter, go_on, const_cast<CancelToken*>(cancel));
  f.oidnCommitFilter(filter);
  if (const DeviceError error = session.error(); error.code != kErrorNone) return failed(error);
  f.oidnExecuteFilter(filter);
  if (const DeviceError error = session.error(); error.code != kErrorNone) return failed(error);
  return ok_status();
}

std::size_t OidnLibrary::scratch_bytes(std::size_t pixels) {
  return std::min(pixels * kNetworkPerPixel, kMostScratch) + pixels * kTiledPerPixel + kWeights;
}

}  // namespace helio
