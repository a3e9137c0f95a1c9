#include "renderer/vulkan/path_device.h"

#include <atomic>
#include <utility>

#include "renderer/vulkan/device/device.h"
#include "renderer/vulkan/scene/device_scene.h"
#include "renderer/vulkan/tracer.h"

namespace helio::vulkan {
namespace {

class UploadedScene final : public SceneOnDevice {
 public:
  explicit UploadedScene(std::shared_ptr<const DeviceScene> scene) : scene_(std::move(scene)) {}
  std::uint64_t bytes() const override { return scene_->bytes(); }
  const DeviceScene& scene() const { return *scene_; }

 private:
  std::shared_ptr<const DeviceScene> scene_;
};

class VulkanPathDevice final : public PathDevice {
 public:
  explicit VulkanPathDevice(std::shared_ptr<Tracer> tracer) : tracer_(std::move(tracer)) {}

  const DeviceInfo& info() const override { return tracer_->device()->info(); }
  Level level() const override { return tracer_->device()->level(); }
  bool lost() const override { return failed_.load(std::memory_order_relaxed) || tracer_->device()->lost(); }

  Result<std::shared_ptr<const SceneOnDevice>> upload(std::shared_ptr<const RenderScene> scene,
                                                      const Admit& admit, const CancelToken* cancel) override {
    auto uploaded = DeviceScene::upload(tracer_->device(), std::move(scene), admit, cancel);
    if (!uploaded) return std::move(uploaded).error();
    return std::shared_ptr<const SceneOnDevice>(std::make_shared<UploadedScene>(std::move(*uploaded)));
  }

  Status prepare(const SceneOnDevice& scene) override {
    return tracer_->prepare(static_cast<const UploadedScene&>(scene).scene());
  }

  Result<bool> trace(const SceneOnDevice& scene, const Camera& camera, const PathSettings& settings,
                     const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                     TraceStats& stats) override {
    auto done = tracer_->trace(static_cast<const UploadedScene&>(scene).scene(), camera, settings, range, window,
                               cancel, film, stats);
    if (!done) failed_.store(true, std::memory_order_relaxed);
    return done;
  }

 private:
  std::shared_ptr<Tracer> tracer_;
  std::atomic<bool> failed_{false};
};

}  // namespace

Result<std::shared_ptr<PathDevice>> PathDevice::open(int index, Level most) {
  DeviceOptions options;
  options.index = index;
  options.level = most;
  auto device = Device::open(options);
  if (!device) return std::move(device).error();
  auto tracer = Tracer::create(std::move(*device));
  if (!tracer) return std::move(tracer).error();
  return std::shared_ptr<PathDevice>(std::make_shared<VulkanPathDevice>(std::move(*tracer)));
}

}  // namespace helio::vulkan
