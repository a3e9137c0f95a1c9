// A scene in the memory of a Vulkan device.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/trace/scene/render_scene.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

// Immutable after upload; safe to share between threads. Freed when nobody holds it.
class DeviceScene {
 public:
  // What `device` needs to trace paths in the scene, by the level that it was opened for: geometry with its BVH or
  // acceleration structures, materials, textures, lights. Takes as long as a build. unimplemented: the scene has what
  // shaders have not (unsupported()); resource_exhausted: the device does not hold it, with bytes and limit; cancelled;
  // unavailable: the device was lost. `admit` is asked before device memory is taken, acceleration structures aside.
  static Result<std::shared_ptr<const DeviceScene>> upload(std::shared_ptr<Device> device,
                                                           std::shared_ptr<const RenderScene> scene,
                                                           const std::function<Status(std::uint64_t bytes)>& admit = {},
                                                           const CancelToken* cancel = nullptr);
  ~DeviceScene();

  const std::shared_ptr<const RenderScene>& scene() const { return scene_; }
  const std::shared_ptr<Device>& device() const { return device_; }
  std::uint64_t address() const { return address_; }  // of its SceneTables
  std::uint64_t bytes() const;                        // of device memory
  // What shaders for the scene need: specialisation constants 0 to 3.
  const std::array<std::uint32_t, 4>& features() const { return features_; }

 private:
  struct Parts;

  DeviceScene() = default;

  std::shared_ptr<Device> device_;
  std::shared_ptr<const RenderScene> scene_;
  std::unique_ptr<Parts> parts_;
  std::uint64_t address_ = 0;
  std::array<std::uint32_t, 4> features_{};
};

}  // namespace helio::vulkan
