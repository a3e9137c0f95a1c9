// Path tracing on Vulkan devices without Vulkan's headers: what the rest of the program uses. In a build without Vulkan
// open() says so.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/render_scene.h"
#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

// A scene in the memory of a device; immutable, freed when nobody holds it.
class SceneOnDevice {
 public:
  virtual ~SceneOnDevice() = default;
  virtual std::uint64_t bytes() const = 0;  // of device memory
};

// Thread safe.
class PathDevice {
 public:
  // Opens the device with this DeviceInfo::index for the highest level that it has, at most `most`. unavailable: there
  // is none, with the reason.
  static Result<std::shared_ptr<PathDevice>> open(int index, Level most = Level::rt);
  virtual ~PathDevice() = default;

  virtual const DeviceInfo& info() const = 0;
  virtual Level level() const = 0;  // what it was opened for
  virtual bool lost() const = 0;    // it failed once and is not to be used again

  // Asked with the bytes of device memory that an upload is about to take, acceleration structures (Level::rt) not
  // counted; its error becomes the upload's.
  using Admit = std::function<Status(std::uint64_t bytes)>;
  // All that the device needs to trace paths in the scene. Takes as long as a build. unimplemented: the scene has what
  // shaders have not, by name; resource_exhausted: the device does not hold it, with bytes and limit; cancelled;
  // unavailable: the device was lost.
  virtual Result<std::shared_ptr<const SceneOnDevice>> upload(std::shared_ptr<const RenderScene> scene,
                                                              const Admit& admit = {},
                                                              const CancelToken* cancel = nullptr) = 0;

  // Has the driver compile the shaders for pictures of the scene, which may take minutes on software devices. Without
  // this call trace() does so. Pictures of other scenes do not wait for it.
  virtual Status prepare(const SceneOnDevice& scene) = 0;

  // As trace_window(), of a scene that was uploaded to this device: adds the samples of the range to each pixel of the
  // window in index order, or leaves the film as it was and returns false when cancelled. For a scene, camera and
  // settings, a device and its driver, the bits depend on pixel, sample index and half alone. An error: the device
  // is lost() from then on; the film is as it was. `device_seconds`: if not null, what the device has worked is added.
  //
  // Precondition: integrator path; the film has neither targets nor history.
  virtual Result<bool> trace(const SceneOnDevice& scene, const Camera& camera, const PathSettings& settings,
                             const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                             TraceStats& stats, double* device_seconds = nullptr) = 0;
};

}  // namespace helio::vulkan
