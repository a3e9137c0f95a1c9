#include "server/sessions/render_context.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/frame/stages/allocate.h"
#include "renderer/frame/stages/trace_lights.h"
#include "renderer/preview/preview_history.h"
#include "server/sessions/replay_token.h"

namespace helio {
namespace {

constexpr double kProgressInterval = 0.25;
constexpr double kLongestCopySeconds = 4;  // that a picture may take to the end of a plan

std::uint64_t pixels(const RenderSettings& settings) {
  return std::uint64_t(settings.width) * std::uint64_t(settings.height);
}

}  // namespace

std::uint64_t film_bytes(const RenderSettings& settings) {
  return pixels(settings) * (Film::bytes_per_pixel(film_state(settings)) + InvalidCounts::kBytesPerPixel);
}

std::uint64_t preview_bytes(const RenderSettings& settings) {
  if (!(settings.preview.rate > 0)) return 0;
  return PreviewHistory::bytes_of(settings.width, settings.height, as_published(settings));
}

std::uint64_t display_bytes(const RenderSettings& settings, unsigned channels) {
  if (!(channels & kResolveDisplay)) return 0;
  return channels & kDisplayByOidn ? DisplayLayer::bytes_by_oidn(pixels(settings))
                                   : pixels(settings) * DisplayLayer::bytes_per_pixel();
}

std::uint64_t scratch_bytes(const RenderSettings& settings) {
  std::uint64_t bytes = 0;
  if (caches_light_vertices(settings.integrator)) bytes += LightVertexSource::most_bytes(path_settings(settings));
  return bytes;
}

namespace {

constexpr const char* kQueue = "the queue of a stream";

std::uint64_t queue_bytes(const RenderSettings& settings, const TileFormat& format) {
  const std::uint64_t previews = settings.preview.rate > 0 ? 2 * pixels(settings) * kPreviewBytesPerPixel : 0;
  return 2 * pixels(settings) * format.bytes_per_pixel() + previews;
}

Result<std::shared_ptr<const Reservation>> reserve(MemoryAccount& account, std::uint64_t bytes,
                                                   const std::string& what, MemoryOwner owner) {
  auto memory = account.reserve_with_room(bytes, what, owner);
  if (!memory) return memory.error();
  return std::make_shared<const Reservation>(std::move(*memory));
}

// What make(memory) makes once so many bytes are reserved for it; null where it takes none.
template <class Make>
auto reserve_for(MemoryAccount& account, std::uint64_t bytes, const std::string& what, MemoryOwner owner,
                 const Make& make)
    -> Result<decltype(make(nullptr))> {
  if (bytes == 0) return decltype(make(nullptr))();
  auto memory = reserve(account, bytes, what, owner);
  if (!memory) return memory.error();
  return make(std::move(*memory));
}

using Count = std::shared_ptr<const Reservation>;

Result<std::shared_ptr<Film>> reserve_film(const RenderContext::Resources& resources, const RenderSettings& settings) {
  return reserve_for(resources.memory, film_bytes(settings),
                     fmt::format("a film of {} x {}", settings.width, settings.height), MemoryOwner::films,
                     [&](Count memory) { return make_film(settings, std::move(memory)); });
}

Result<std::shared_ptr<PreviewHistory>> reserve_previews(const RenderContext::Resources& resources,
                                                         const RenderSettings& settings) {
  return reserve_for(resources.memory, preview_bytes(settings),
                     fmt::format("previews of {} x {}", settings.width, settings.height), MemoryOwner::previews,
                     [&](Count memory) { return make_preview_history(settings, std::move(memory)); });
}

Result<std::shared_ptr<DisplayLayer>> reserve_display(const RenderContext::Resources& resources,
                                                      const RenderSettings& settings, unsigned channels) {
  return reserve_for(resources.memory, display_bytes(settings, channels),
                     fmt::format("the layer display of {} x {}", settings.width, settings.height), MemoryOwner::display,
                     [&](Count memory) {
                       return make_display_layer(settings, channels, resources.oidn, std::move(memory));
                     });
}

Result<std::shared_ptr<const Reservation>> reserve_scratch(const RenderContext::Resources& resources,
                                                           const RenderSettings& settings) {
  return reserve(resources.memory, scratch_bytes(settings),
                 fmt::format("light paths of {} x {} pixels", settings.width, settings.height),
                 MemoryOwner::light_vertices);
}

}  // namespace

Result<std::shared_ptr<RenderContext>> RenderContext::create(const Resources& resources, SceneLease scene,
                                                             const RenderSettings& settings, const Budget& budget,
                                                             RenderRank rank, FramePublisher::Tiles tiles,
                                                             unsigned channels, std::shared_ptr<FrameSink> sink,
                                                             std::optional<CheckpointOptions> checkpoints) {
  auto film = reserve_film(resources, settings);
  if (!film) return film.error();
  auto scratch = reserve_scratch(resources, settings);
  if (!scratch) return scratch.error();
  auto previews = reserve_previews(resources, settings);
  if (!previews) return previews.error();
  auto display = reserve_display(resources, settings, channels);
  if (!display) return display.error();
  if (checkpoints) {
    auto memory = reserve(resources.memory, checkpoint_bytes(settings), "checkpoints", MemoryOwner::checkpoints);
    if (!memory) return memory.error();
    checkpoints->count = std::move(*memory);
  }
  const std::shared_ptr<RenderContext> rendering(new RenderContext(resources),
                                                 [](RenderContext* r) { r->give_to_reaper(); });
  rendering->scenes_->current = std::move(scene);
  rendering->publisher_ = std::make_shared<FramePublisher>(
      tiles, [scenes = rendering->scenes_](const FrameBegin& frame, const InvalidSample& sample) {
        const auto snapshot = frame.scene.lock();
        const std::lock_guard lock(scenes->mutex);
        if (!scenes->current.get()) return std::string();  // the rendering has ended
        if (scenes->current->snapshot == snapshot) return make_replay_token(*scenes->current, frame, sample);
        const auto before = scenes->before.lock();
        return before && before->snapshot == snapshot ? make_replay_token(*before, frame, sample) : std::string();
      },
      rank == RenderRank::interactive ? resources.counters : nullptr);
  RenderLoopOptions options;
  options.channels = channels;
  options.oidn = resources.oidn;
  options.publish_passes = tiles == FramePublisher::Tiles::all;
  options.film = std::move(*film);
  options.scratch_count = *scratch;
  options.previews = std::move(*previews);
  options.display = std::move(*display);
  options.checkpoints = std::move(checkpoints);
  options.owner = resources.owner;
  rendering->device_ = std::make_shared<DeviceRendering>(
      [publisher = std::weak_ptr(rendering->publisher_)](const std::string& notice) {
        if (const auto told = publisher.lock()) told->tell(notice);
      });
  options.make_tracer = [device = rendering->device_](std::shared_ptr<const RenderScene> traced) {
    return device->tracer(std::move(traced));
  };
  Status placed = rendering->place(settings.device, rendering->scene().snapshot);
  if (!placed) return std::move(placed).error();
  rendering->scratch_ = *scratch;
  if (!sink) sink = rendering->publisher_;
  rendering->loop_ = std::make_unique<RenderLoop>(resources.engine, rendering->scene().snapshot, settings, budget, rank,
                                                  std::move(sink), options);
  return rendering;
}

const LoadedScene& RenderContext::scene() const {
  const std::lock_guard lock(scenes_->mutex);
  return *scenes_->current;
}

void RenderContext::release_device() {
  device_->release();
}

std::uint64_t RenderContext::switch_scene(SceneLease scene, RenderLoop::Update update) {
  update.scene = scene->snapshot;
  const auto exchange = [&](std::weak_ptr<const LoadedScene> before) {
    const std::lock_guard lock(scenes_->mutex);
    std::swap(scenes_->current, scene);
    return std::exchange(scenes_->before, std::move(before));
  };
  // Known before the first of its frames can begin.
  const auto before = exchange(this->scene().weak_from_this());
  try {
    return loop_->update(update);
  } catch (...) {
    exchange(before);
    throw;
  }
}

Status RenderContext::place(const RenderDevice& device, const std::shared_ptr<const RenderScene>& scene) {
  if (device_->use(device, scene.get())) return ok_status();
  if (!resources_.devices)
    return Error{ErrorCode::failed_precondition, to_string(device) + ": only the CPU renders here", "device"};
  auto placed = resources_.devices->place(device, scene);
  if (!placed) return std::move(placed).error();
  device_->keep(device, std::move(*placed));
  return ok_status();
}

Status RenderContext::prepare(const RenderSettings& settings, unsigned channels, RenderLoop::Update& update) {
  if (!loop_->film_suits(settings)) {
    auto film = reserve_film(resources_, settings);
    if (!film) return film.error();
    update.film = std::move(*film);
  }
  const auto before = scratch_.lock();
  if (!before || before->bytes() != scratch_bytes(settings)) {
    auto scratch = reserve_scratch(resources_, settings);
    if (!scratch) return scratch.error();
    scratch_ = *scratch;
    update.scratch_count = std::move(*scratch);
  }
  if (!loop_->previews_suit(settings)) {
    auto previews = reserve_previews(resources_, settings);
    if (!previews) return previews.error();
    update.previews = std::move(*previews);
  }
  return prepare_display(settings, channels, update);
}

Status RenderContext::prepare_display(const RenderSettings& settings, unsigned channels, RenderLoop::Update& update) {
  if (loop_->display_suits(settings, channels)) return ok_status();
  auto display = reserve_display(resources_, settings, channels);
  if (!display) return display.error();
  update.display = std::move(*display);
  return ok_status();
}

Result<std::shared_ptr<const PictureCheckpoint>> RenderContext::copy_picture(const RenderSettings& settings,
                                                                             const Budget& budget,
                                                                             double deadline_s) {
  if (!can_checkpoint(settings)) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("mode {} with variant {} draws on pictures before it, which are not copied",
                             to_string(settings.mode), to_string(settings.variant)),
                 {}};
  }
  auto memory = resources_.memory.reserve(checkpoint_bytes(settings), "a copy of the picture");
  if (!memory) return memory.error();
  struct Copy {
    std::mutex mutex;
    std::condition_variable made;
    std::shared_ptr<const PictureCheckpoint> picture;
  };
  const auto copy = std::make_shared<Copy>();
  CheckpointOptions options;
  options.interval_s = 0;
  options.keep = [copy](std::shared_ptr<const PictureCheckpoint> picture) {
    const std::lock_guard lock(copy->mutex);
    copy->picture = std::move(picture);
    copy->made.notify_all();
  };
  options.count = std::make_shared<const Reservation>(std::move(*memory));
  loop_->begin_checkpoints(std::move(options));
  loop_->checkpoint_soon();
  RenderLoop::Update go_on;
  go_on.budget = budget;
  loop_->update(go_on);
  const double left = std::clamp(deadline_s - now_s(), 0.0, kLongestCopySeconds);
  std::unique_lock lock(copy->mutex);
  copy->made.wait_for(lock, std::chrono::duration<double>(left), [&] { return copy->picture != nullptr; });
  auto picture = std::exchange(copy->picture, nullptr);
  lock.unlock();
  loop_->cancel();
  if (!picture) return Error{ErrorCode::unavailable, "its picture could not be copied in time", {}};
  return picture;
}

Result<Reservation> RenderContext::reserve_queue(const RenderSettings& settings, const TileFormat& format) const {
  return resources_.memory.reserve_with_room(queue_bytes(settings, format), kQueue, MemoryOwner::queues);
}

Status RenderContext::keep_queue(Result<Reservation> memory, const RenderSettings& settings, const TileFormat& format) {
  const std::uint64_t bytes = queue_bytes(settings, format);
  if (memory && memory->bytes() != bytes) memory = resources_.memory.reserve(bytes, kQueue, MemoryOwner::queues);
  if (!memory) return memory.error();
  queue_memory_ = std::move(*memory);
  return ok_status();
}

// The scene may be unloaded at once; what is left of it here stays counted until the loop has gone.
void RenderContext::give_to_reaper() noexcept {
  {
    const std::lock_guard lock(scenes_->mutex);
    scenes_->current = {};
  }
  resources_.reaper.take(this);
}

void RenderContext::report_progress(const std::shared_ptr<OutboundStream>& stream) {
  report_progress_later(stream, -1);
}

void RenderContext::report_progress_later(std::weak_ptr<OutboundStream> stream, double seconds_told) {
  resources_.timers.call_at(now_s() + kProgressInterval, [weak = weak_from_this(), stream, seconds_told] {
    const auto rendering = weak.lock();
    const auto listener = stream.lock();
    if (!rendering || !listener || listener->finished() || rendering->publisher_->stream() != listener) return;
    const FrameProgress progress = rendering->loop_->progress();
    if (progress.seconds != seconds_told) listener->push(progress);
    rendering->report_progress_later(stream, progress.seconds);
  });
}

}  // namespace helio
