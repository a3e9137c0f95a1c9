#include "renderer/vulkan/path_device.h"

#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "renderer/vulkan/device/device.h"
#include "renderer/vulkan/scene/device_scene.h"
#include "renderer/vulkan/tracer.h"

namespace helio::vulkan {
namespace {

struct UploadedScene final : SceneOnDevice {
  UploadedScene(std::shared_ptr<Tracer> with, std::shared_ptr<const DeviceScene> placed)
      : tracer(std::move(with)), scene(std::move(placed)) {}
  std::uint64_t bytes() const override { return scene->bytes(); }

  const std::shared_ptr<Tracer> tracer;
  const std::shared_ptr<const DeviceScene> scene;
};

const UploadedScene& uploaded(const SceneOnDevice& scene) {
  return static_cast<const UploadedScene&>(scene);
}

Result<std::shared_ptr<Tracer>> open_tracer(const DeviceOptions& options) {
  auto device = Device::open(options);
  if (!device) return std::move(device).error();
  return Tracer::create(std::move(*device));
}

// Software devices compile a shader when it is first dispatched, on the thread that serves their queue: pictures of
// other scenes would wait for it. Each kind of scene has a VkDevice, and so a queue, of its own there.
class VulkanPathDevice final : public PathDevice {
 public:
  VulkanPathDevice(const DeviceOptions& options, std::shared_ptr<Tracer> tracer)
      : options_(options), tracer_(std::move(tracer)) {}

  const DeviceInfo& info() const override { return tracer_->device()->info(); }
  Level level() const override { return tracer_->device()->level(); }
  bool lost() const override { return failed_.load(std::memory_order_relaxed) || tracer_->device()->lost(); }

  Result<std::shared_ptr<const SceneOnDevice>> upload(std::shared_ptr<const RenderScene> scene, const Admit& admit,
                                                      const CancelToken* cancel) override {
    auto host = make_host_scene(std::move(scene), level(), cancel);
    if (!host) return std::move(host).error();
    if (Status admitted = admit ? admit(host->bytes()) : ok_status(); !admitted) return std::move(admitted).error();
    auto tracer = tracer_for(host->features);
    if (!tracer) return std::move(tracer).error();
    auto placed = DeviceScene::upload((*tracer)->device(), std::move(*host), cancel);
    if (!placed) return std::move(placed).error();
    return std::shared_ptr<const SceneOnDevice>(
        std::make_shared<UploadedScene>(std::move(*tracer), std::move(*placed)));
  }

  Status prepare(const SceneOnDevice& scene) override {
    Status prepared = uploaded(scene).tracer->prepare(*uploaded(scene).scene);
    if (uploaded(scene).tracer->device()->lost()) failed_.store(true, std::memory_order_relaxed);
    return prepared;
  }

  Result<bool> trace(const SceneOnDevice& scene, const Camera& camera, const PathSettings& settings,
                     const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                     TraceStats& stats, double* device_seconds) override {
    auto done = uploaded(scene).tracer->trace(*uploaded(scene).scene, camera, settings, range, window, cancel, film,
                                              stats, device_seconds);
    if (!done) failed_.store(true, std::memory_order_relaxed);
    return done;
  }

 private:
  // The most kinds of scenes whose compiled shaders are kept while no scene of theirs is on the device: lavapipe
  // holds some 180 MB for each, which no account sees.
  static constexpr std::size_t kKept = 4;

  Result<std::shared_ptr<Tracer>> tracer_for(const ShaderFeatures& features) {
    if (info().type != "cpu") return tracer_;
    const std::lock_guard lock(mutex_);
    const auto found = tracers_.find(features);
    if (found != tracers_.end() && !found->second->device()->lost()) return found->second;
    auto opened = open_tracer(options_);
    if (!opened) return opened;
    for (auto it = tracers_.begin(); it != tracers_.end() && tracers_.size() >= kKept;)
      it = it->second.use_count() == 1 ? tracers_.erase(it) : std::next(it);
    return tracers_[features] = std::move(*opened);
  }

  const DeviceOptions options_;
  const std::shared_ptr<Tracer> tracer_;
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::map<ShaderFeatures, std::shared_ptr<Tracer>> tracers_;  // of software devices
};

}  // namespace

Result<std::shared_ptr<PathDevice>> PathDevice::open(int index, Level most) {
  DeviceOptions options;
  options.index = index;
  options.level = most;
  auto tracer = open_tracer(options);
  if (!tracer) return std::move(tracer).error();
  return std::shared_ptr<PathDevice>(std::make_shared<VulkanPathDevice>(options, std::move(*tracer)));
}

}  // namespace helio::vulkan
