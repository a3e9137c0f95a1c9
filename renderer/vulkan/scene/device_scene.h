// A scene in the memory of a Vulkan device.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/trace/scene/render_scene.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/device.h"
#include "renderer/vulkan/scene/host_scene.h"

namespace helio::vulkan {

// Immutable after upload; safe to share between threads. Freed when nobody holds it.
class DeviceScene {
 public:
  // Uploads what make_host_scene() has made for the device's level. resource_exhausted: the device does not hold it,
  // with bytes and limit; cancelled; unavailable: the device was lost.
  static Result<std::shared_ptr<const DeviceScene>> upload(std::shared_ptr<Device> device, HostScene host,
                                                           const CancelToken* cancel = nullptr);
  // Uploads `scene` by make_host_scene() and upload(), and fails as they do.
  static Result<std::shared_ptr<const DeviceScene>> upload(std::shared_ptr<Device> device,
                                                           std::shared_ptr<const RenderScene> scene,
                                                           const CancelToken* cancel = nullptr);
  ~DeviceScene();

  const std::shared_ptr<const RenderScene>& scene() const { return scene_; }
  const std::shared_ptr<Device>& device() const { return device_; }
  std::uint64_t address() const { return address_; }  // of its SceneTables
  std::uint64_t bytes() const;                        // of device memory
  const ShaderFeatures& features() const { return features_; }
  // What a sample has taken of late, seconds; 0: none was traced.
  std::atomic<float>& sample_seconds() const { return sample_seconds_; }

 private:
  struct Parts;

  DeviceScene() = default;

  std::shared_ptr<Device> device_;
  std::shared_ptr<const RenderScene> scene_;
  std::unique_ptr<Parts> parts_;
  std::uint64_t address_ = 0;
  ShaderFeatures features_{};
  mutable std::atomic<float> sample_seconds_{0};
};

}  // namespace helio::vulkan
