#include "server/sessions/device_rendering.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "renderer/frame/thread_clock.h"
#include "renderer/vulkan/probe/probe.h"

namespace helio {

namespace {

class MachineDevices final : public DeviceSource {
 public:
  bool listed() const override { return probe_.finished(); }
  // Software devices trace our own BVH several times as fast as their acceleration structures (helio_bench vulkan).
  vulkan::DeviceList list() const override {
    vulkan::DeviceList found = probe_.devices();
    for (vulkan::DeviceInfo& info : found.devices) {
      if (info.type != "cpu" || info.level <= vulkan::Level::compute) continue;
      info.reason = fmt::format("{} works, too, and is slower on software devices", vulkan::level_name(info.level));
      info.level = vulkan::Level::compute;
    }
    return found;
  }
  Result<std::shared_ptr<vulkan::PathDevice>> open(const vulkan::DeviceInfo& listed) override {
    return vulkan::PathDevice::open(listed.index, listed.level);
  }

 private:
  vulkan::DeviceProbe probe_;
};

}  // namespace

std::unique_ptr<DeviceSource> machine_devices() {
  return std::make_unique<MachineDevices>();
}

RenderDevices::RenderDevices(std::unique_ptr<DeviceSource> source, MemoryAccount& memory)
    : memory_(memory), source_(std::move(source)) {}

vulkan::DeviceList RenderDevices::list() const {
  if (!source_) return {{}, "the daemon renders on its CPU alone; --devices cpu,vulkan allows Vulkan devices"};
  vulkan::DeviceList found = source_->list();
  const std::lock_guard lock(mutex_);
  for (vulkan::DeviceInfo& info : found.devices) {
    const auto opened = open_.find(info.index);
    if (opened == open_.end() || !opened->second.device || !opened->second.device->lost()) continue;
    info.level = vulkan::Level::none;
    info.reason = "it failed, and is not used again until the daemon is restarted";
  }
  return found;
}

Result<vulkan::DeviceInfo> RenderDevices::find(const RenderDevice& device) const {
  const std::string name = to_string(device);
  const vulkan::DeviceList found = list();
  if (found.devices.empty()) return Error{ErrorCode::failed_precondition, name + ": " + found.reason, "device"};
  std::string reasons;
  for (const vulkan::DeviceInfo& info : found.devices) {
    if (device.index != RenderDevice::kAny && info.index != device.index) continue;
    if (info.level != vulkan::Level::none) return info;
    reasons += fmt::format("{}vulkan:{} ({}): {}", reasons.empty() ? "" : "; ", info.index, info.name, info.reason);
  }
  if (!reasons.empty() && found.late)
    return Error{ErrorCode::unavailable, name + " is not ready: " + reasons + "; try again in half a minute", "device"};
  if (!reasons.empty())
    return Error{ErrorCode::failed_precondition, name + " cannot trace paths: " + reasons, "device"};
  const std::size_t count = found.devices.size();
  const std::string there =
      count == 1 ? "there is vulkan:0" : fmt::format("there are vulkan:0 to vulkan:{}", count - 1);
  return Error{ErrorCode::not_found, name + ": no such device; " + there, "device"};
}

Result<std::shared_ptr<vulkan::PathDevice>> RenderDevices::open(const vulkan::DeviceInfo& info,
                                                                const std::shared_ptr<const RenderScene>& scene,
                                                                std::shared_ptr<Place>& place) {
  const std::lock_guard opening(opening_mutex_);
  std::unique_lock lock(mutex_);
  Open& open = open_[info.index];
  if (!open.device) {
    lock.unlock();
    auto opened = source_->open(info);
    if (!opened) return Error{ErrorCode::failed_precondition, opened.error().message, "device"};
    lock.lock();
    open.device = std::move(*opened);
    spdlog::info("vulkan:{} is {}, with {}; paths by {}", info.index, info.name, info.driver,
                 vulkan::level_name(open.device->level()));
  }
  std::erase_if(open.places, [](const auto& each) { return each->scene.expired(); });
  for (const auto& each : open.places) {
    if (each->scene.lock() == scene) place = each;
  }
  if (!place) {
    place = open.places.emplace_back(std::make_shared<Place>());
    place->scene = scene;
  }
  return open.device;
}

Result<std::shared_ptr<const PlacedScene>> RenderDevices::place(const RenderDevice& device,
                                                                std::shared_ptr<const RenderScene> scene) {
  const auto info = find(device);
  if (!info) return info.error();
  std::shared_ptr<Place> place;
  const auto opened = open(*info, scene, place);
  if (!opened) return opened.error();
  const std::lock_guard placing(place->mutex);
  if (auto placed = place->placed.lock()) return placed;
  const auto refused = [&](const Error& error) {
    // What fails is the device, not the daemon, which `unavailable` would say.
    const ErrorCode code = error.code == ErrorCode::unavailable ? ErrorCode::failed_precondition : error.code;
    return Error{code, to_string(device) + ": " + error.to_string(), "device"};
  };
  auto placed = std::make_shared<PlacedScene>();
  placed->name = "vulkan:" + std::to_string(info->index);
  const auto reserve = [&](std::uint64_t bytes) -> Status {
    placed->memory = {};
    auto memory = memory_.reserve_with_room(bytes, "the scene on " + placed->name, MemoryOwner::devices);
    if (!memory) return std::move(memory).error();
    placed->memory = std::move(*memory);
    return ok_status();
  };
  auto data = (*opened)->upload(scene, reserve);
  if (!data) return refused(data.error());
  if (const Status all = reserve((*data)->bytes()); !all.ok()) return all.error();
  if (const Status prepared = (*opened)->prepare(**data); !prepared.ok()) return refused(prepared.error());
  placed->scene = std::move(scene);
  placed->device = *opened;
  placed->data = std::move(*data);
  place->placed = placed;
  return std::shared_ptr<const PlacedScene>(std::move(placed));
}

void DeviceRendering::keep(const RenderDevice& asked, std::shared_ptr<const PlacedScene> placed) {
  Kept kept{asked, std::move(placed)};
  const std::lock_guard lock(mutex_);
  std::swap(kept_[1], kept);
  std::swap(kept_[0], kept_[1]);
}

std::shared_ptr<const PlacedScene> DeviceRendering::find(const RenderDevice& device, const RenderScene* scene) const {
  const std::lock_guard lock(mutex_);
  for (const Kept& kept : kept_) {
    if (kept.placed && kept.asked == device && kept.placed->scene.get() == scene) return kept.placed;
  }
  return nullptr;
}

void DeviceRendering::release() {
  std::array<Kept, 2> gone;
  const std::lock_guard lock(mutex_);
  std::swap(gone, kept_);
}

bool DeviceRendering::use(const RenderDevice& device, const RenderScene* scene) {
  if (device.kind == RenderDevice::Kind::cpu) return true;
  const std::lock_guard lock(mutex_);
  const auto serves = [&](const Kept& kept) {
    return kept.placed && kept.asked == device && (kept.placed->scene.get() == scene || kept.placed->device->lost());
  };
  if (serves(kept_[0])) return true;
  if (!serves(kept_[1])) return false;
  std::swap(kept_[0], kept_[1]);
  return true;
}

// For a scene that is not there: the newest that is, whose device may have failed. Null after release().
std::shared_ptr<const PlacedScene> DeviceRendering::newest() const {
  const std::lock_guard lock(mutex_);
  return kept_[0].placed;
}

// Sends a notice about the device that `on` lies on, once for each device.
void DeviceRendering::tell(const PlacedScene& on, std::string_view what) {
  const std::string notice =
      fmt::format("{} ({}) {}; the picture goes on on the CPU", on.name, on.device->info().name, what);
  {
    const std::lock_guard lock(mutex_);
    if (!told_.insert(on.name).second) return;
    failure_ = notice;
  }
  spdlog::warn("{}", notice);
  notify_(notice);
}

std::string DeviceRendering::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

IntegrateFunction DeviceRendering::tracer(std::shared_ptr<const RenderScene> scene) {
  return [self = shared_from_this(), scene, cpu = path_tracer(scene)](
             const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    const RenderDevice& device = job.settings.device;
    if (device.kind == RenderDevice::Kind::cpu) return cpu(job, cancel, film, stats);
    const auto placed = self->find(device, scene.get());
    const auto other = placed ? placed : self->newest();
    if (!placed || placed->device->lost()) {
      if (other) self->tell(*other, other->device->lost() ? "has failed" : "does not hold the scene any more");
      return cpu(job, cancel, film, stats);
    }
    const Camera camera(job.camera, job.settings.width, job.settings.height, scene->origin(), job.settings.filter);
    double device_s = 0;
    const Result<bool> done = placed->device->trace(*placed->data, camera, path_settings(job.settings), job.range,
                                                    job.window, cancel, film, stats, &device_s);
    charge_device_time(device_s);
    if (done) return *done;
    self->tell(*placed, "failed: " + done.error().message);
    return cpu(job, cancel, film, stats);
  };
}

}  // namespace helio
