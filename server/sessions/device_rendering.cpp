#include "server/sessions/device_rendering.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/frame/thread_clock.h"
#include "renderer/vulkan/probe/probe.h"

namespace helio {

namespace {

class MachineDevices final : public DeviceSource {
 public:
  bool listed() const override { return probe_.finished(); }
  vulkan::DeviceList list() const override { return probe_.devices(); }
  // Software devices trace our own BVH several times as fast as their acceleration structures (helio_bench vulkan).
  Result<std::shared_ptr<vulkan::PathDevice>> open(int index) override {
    vulkan::Level level = vulkan::Level::none;
    for (const vulkan::DeviceInfo& info : list().devices) {
      if (info.index == index) level = info.type == "cpu" ? std::min(info.level, vulkan::Level::compute) : info.level;
    }
    return vulkan::PathDevice::open(index, level);
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
  return source_->list();
}

Result<int> RenderDevices::index_of(const RenderDevice& device) const {
  const std::string name = to_string(device);
  const vulkan::DeviceList found = list();
  if (!source_) return Error{ErrorCode::failed_precondition, name + ": " + found.reason, "device"};
  if (found.devices.empty()) return Error{ErrorCode::unavailable, name + ": " + found.reason, "device"};
  std::string reasons;
  for (const vulkan::DeviceInfo& info : found.devices) {
    if (device.index != RenderDevice::kAny && info.index != device.index) continue;
    if (info.level != vulkan::Level::none) return info.index;
    reasons += fmt::format("{}vulkan:{} ({}): {}", reasons.empty() ? "" : "; ", info.index, info.name, info.reason);
  }
  if (reasons.empty())
    return Error{ErrorCode::not_found,
                 fmt::format("{}: no such device; there are vulkan:0 to vulkan:{}", name, found.devices.size() - 1),
                 "device"};
  return Error{ErrorCode::unavailable, name + " cannot trace paths: " + reasons, "device"};
}

Result<std::shared_ptr<const PlacedScene>> RenderDevices::place(const RenderDevice& device,
                                                                std::shared_ptr<const RenderScene> scene) {
  const auto index = index_of(device);
  if (!index) return index.error();
  const std::lock_guard lock(mutex_);
  Open& open = open_[*index];
  if (!open.device) {
    auto opened = source_->open(*index);
    if (!opened) return opened.error();
    open.device = std::move(*opened);
    spdlog::info("vulkan:{} is {}, with {}; paths by {}", *index, open.device->info().name, open.device->info().driver,
                 vulkan::level_name(open.device->level()));
  }
  if (open.device->lost())
    return Error{ErrorCode::unavailable, to_string(device) + " failed before, and is not used again", "device"};
  std::erase_if(open.scenes, [](const auto& held) { return held.expired(); });
  for (const auto& held : open.scenes) {
    const auto placed = held.lock();
    if (placed && placed->scene == scene) return placed;
  }
  const auto refused = [&](const Error& error) {
    return Error{error.code, to_string(device) + ": " + error.to_string(), "device"};
  };
  auto placed = std::make_shared<PlacedScene>();
  const auto reserve = [&](std::uint64_t bytes) -> Status {
    placed->memory = {};
    auto memory = memory_.reserve_with_room(bytes, "the scene on " + placed->name);
    if (!memory) return std::move(memory).error();
    placed->memory = std::move(*memory);
    return ok_status();
  };
  placed->name = "vulkan:" + std::to_string(*index);
  auto data = open.device->upload(scene, reserve);
  if (!data) return refused(data.error());
  if (const Status all = reserve((*data)->bytes()); !all.ok()) return all.error();
  if (const Status prepared = open.device->prepare(**data); !prepared.ok()) return refused(prepared.error());
  placed->scene = std::move(scene);
  placed->device = open.device;
  placed->data = std::move(*data);
  open.scenes.push_back(placed);
  return std::shared_ptr<const PlacedScene>(std::move(placed));
}

void DeviceRendering::keep(const RenderDevice& asked, std::shared_ptr<const PlacedScene> placed) {
  Kept kept{asked, std::move(placed)};
  const std::lock_guard lock(mutex_);
  if (kept_[0].asked == kept.asked && kept_[0].placed == kept.placed) return;
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

bool DeviceRendering::has(const RenderDevice& device, const RenderScene* scene) const {
  return device.kind == RenderDevice::Kind::cpu || find(device, scene) != nullptr;
}

void DeviceRendering::failed(const PlacedScene& placed, const Error& error) {
  const std::string notice = fmt::format("{} ({}) failed: {}; the picture goes on on the CPU", placed.name,
                                         placed.device->info().name, error.message);
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(told_, true)) return;
  }
  spdlog::warn("{}", notice);
  notify_(notice);
}

IntegrateFunction DeviceRendering::tracer(std::shared_ptr<const RenderScene> scene) {
  return [self = shared_from_this(), scene, cpu = path_tracer(scene)](
             const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    const auto placed =
        job.settings.device.kind == RenderDevice::Kind::cpu ? nullptr : self->find(job.settings.device, scene.get());
    if (!placed || placed->device->lost()) return cpu(job, cancel, film, stats);
    const Camera camera(job.camera, job.settings.width, job.settings.height, scene->origin(), job.settings.filter);
    const double started = now_s(), own = thread_cpu_s();
    const Result<bool> done = placed->device->trace(*placed->data, camera, path_settings(job.settings), job.range,
                                                    job.window, cancel, film, stats);
    charge_device_time((now_s() - started) - (thread_cpu_s() - own));
    if (done) return *done;
    self->failed(*placed, done.error());
    return cpu(job, cancel, film, stats);
  };
}

}  // namespace helio
