// Path tracing of a window of a film on a Vulkan device: what trace_window() does on the processor
// (trace/paths/path_integrator.h), for integrator path and films without history.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/compute_pipeline.h"
#include "renderer/vulkan/device/ray_pipeline.h"
#include "renderer/vulkan/scene/device_scene.h"

namespace helio::vulkan {

struct PathTask;  // shaders/tables/task.h

// The pipelines of a device, and what dispatches in flight work with. Thread safe.
class Tracer {
 public:
  // Traces by the level that the device was opened for.
  static Result<std::shared_ptr<Tracer>> create(std::shared_ptr<Device> device);
  const std::shared_ptr<Device>& device() const { return device_; }

  // Makes the pipeline for pictures of such a scene and has the driver compile it, which may take minutes on software
  // devices; trace() does the same where nobody has. Pictures that have their pipeline do not wait for it.
  Status prepare(const DeviceScene& scene);

  // As trace_window(): adds the samples of the range to each pixel of the window in index order. For a scene, camera
  // and settings, a device and its driver, the bits added depend on pixel, sample index and half alone. False:
  // cancelled, the film is as it was. An error: the device cannot be used any more; the film is as it was.
  // `device_seconds`: if not null, what the device has worked for it is added, without the wait for others.
  //
  // Precondition: integrator path; the scene was uploaded to this device; the film has neither targets nor history.
  Result<bool> trace(const DeviceScene& scene, const Camera& camera, const PathSettings& settings,
                     const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                     TraceStats& stats, double* device_seconds = nullptr);

 private:
  // One dispatch in flight.
  struct Slot {
    CommandSlot commands;
    Buffer task, answers, first_hits;
  };
  // The pipeline that traces one kind of scene: `compute`, or `rays` at Level::rt.
  struct Pipeline {
    std::optional<ComputePipeline> compute;
    std::optional<RayPipeline> rays;
  };

  explicit Tracer(std::shared_ptr<Device> device) : device_(device), arena_(std::move(device)) {}
  const Pipeline* find(const ShaderFeatures& features);
  Result<const Pipeline*> pipeline_for(const DeviceScene& scene);
  Result<std::unique_ptr<Slot>> take_slot(std::uint64_t samples, bool first_hits);
  void give_back(std::unique_ptr<Slot> slot);
  // Runs the task and returns the seconds that the device worked for it.
  Result<double> dispatch(const Pipeline& pipeline, Slot& slot, std::uint64_t scene, const PathTask& task,
                          std::chrono::milliseconds limit = kSubmissionLimit);

  std::shared_ptr<Device> device_;
  Arena arena_;
  std::uint64_t filter_ = 0;  // address of gaussian_pieces(): density, then integral
  std::atomic<double> last_answer_{0};  // when the device ended a dispatch
  std::mutex compile_mutex_;            // held while a pipeline is compiled
  std::mutex mutex_;
  std::map<ShaderFeatures, std::unique_ptr<const Pipeline>> pipelines_;
  std::vector<std::unique_ptr<Slot>> free_;  // as many as were ever in flight at once
};

}  // namespace helio::vulkan
