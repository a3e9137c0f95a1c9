// Rendering on Vulkan devices: the devices of the daemon with the scenes that lie on them, and what a session or a job
// renders with.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/frame/integrate_function.h"
#include "renderer/frame/render_device.h"
#include "renderer/vulkan/path_device.h"
#include "server/base/memory_account.h"

namespace helio {

// A scene on a device.
struct PlacedScene {
  std::string name;  // of the device: "vulkan:N"
  std::shared_ptr<const RenderScene> scene;
  std::shared_ptr<vulkan::PathDevice> device;
  std::shared_ptr<const vulkan::SceneOnDevice> data;
  Reservation memory;
};

// Where Vulkan devices come from. Thread safe.
class DeviceSource {
 public:
  virtual ~DeviceSource() = default;
  virtual bool listed() const = 0;              // list() does not wait
  // Empty, with the reason, where there are none; levels are those to open devices for.
  virtual vulkan::DeviceList list() const = 0;
  virtual Result<std::shared_ptr<vulkan::PathDevice>> open(const vulkan::DeviceInfo& listed) = 0;
};

// This machine's, tested by a process of its own from the call on.
std::unique_ptr<DeviceSource> machine_devices();

// The devices that sessions and jobs render on, each opened once, and the scenes that lie on them. Thread safe.
class RenderDevices {
 public:
  // Without a source, which is the operator's word (--devices), every device but the CPU is refused.
  RenderDevices(std::unique_ptr<DeviceSource> source, MemoryAccount& memory);

  bool listed() const { return !source_ || source_->listed(); }
  // Of devices that failed since, that they did.
  vulkan::DeviceList list() const;

  // Opens the device, if nobody has, puts the scene on it, if nobody holds it there, and has shaders compiled. Takes as
  // long as a build, on software devices minutes; calls for other scenes do not wait. failed_precondition: devices are
  // not allowed, there are none, or it does not work, with the reason; not_found: no such device; unimplemented: the
  // scene has what shaders have not; resource_exhausted. Precondition: not the CPU.
  Result<std::shared_ptr<const PlacedScene>> place(const RenderDevice& device,
                                                   std::shared_ptr<const RenderScene> scene);

 private:
  // A scene's on one device.
  struct Place {
    std::weak_ptr<const RenderScene> scene;
    std::mutex mutex;  // held by whoever puts it there
    std::weak_ptr<const PlacedScene> placed;
  };
  struct Open {
    std::shared_ptr<vulkan::PathDevice> device;
    std::vector<std::shared_ptr<Place>> places;
  };

  Result<vulkan::DeviceInfo> find(const RenderDevice& device) const;
  Result<std::shared_ptr<vulkan::PathDevice>> open(const vulkan::DeviceInfo& info,
                                                   const std::shared_ptr<const RenderScene>& scene,
                                                   std::shared_ptr<Place>& place);

  MemoryAccount& memory_;
  const std::unique_ptr<DeviceSource> source_;  // null: not allowed
  std::mutex opening_mutex_;                    // held while a device is opened
  mutable std::mutex mutex_;                    // not held while a device is opened or a scene is put there
  std::map<int, Open> open_;
};

// What the pictures of one rendering are traced with: by settings.device, on the device where the scene was placed,
// else on the CPU. When a device fails the pictures go on on the CPU, with a notice. Thread safe.
class DeviceRendering : public std::enable_shared_from_this<DeviceRendering> {
 public:
  using Notify = std::function<void(const std::string& notice)>;
  explicit DeviceRendering(Notify notify) : notify_(std::move(notify)) {}

  // What RenderDevices::place() gave for `asked`. Keeps it and the one before, whose frames may still be in flight.
  void keep(const RenderDevice& asked, std::shared_ptr<const PlacedScene> placed);
  // Gives back what was kept: frames still in flight go on on the CPU.
  void release();
  // Whether pictures of this scene by this device need no other place(): it is there, or the device has failed. Counts
  // as the newest then.
  bool use(const RenderDevice& device, const RenderScene* scene);
  IntegrateFunction tracer(std::shared_ptr<const RenderScene> scene);
  // The notice of the newest device that has failed; empty: none has.
  std::string failure() const;

 private:
  struct Kept {
    RenderDevice asked;
    std::shared_ptr<const PlacedScene> placed;
  };

  std::shared_ptr<const PlacedScene> find(const RenderDevice& device, const RenderScene* scene) const;
  std::shared_ptr<const PlacedScene> newest() const;
  void tell(const PlacedScene& on, std::string_view what);

  const Notify notify_;
  mutable std::mutex mutex_;
  std::array<Kept, 2> kept_;
  std::set<std::string> told_;  // PlacedScene::name of devices of which the client knows that they failed
  std::string failure_;
};

}  // namespace helio
