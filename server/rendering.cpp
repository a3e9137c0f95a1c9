#include "server/rendering.h"

#include <spdlog/fmt/fmt.h>

#include "renderer/base/clock.h"
#include "renderer/frame/passes/allocate.h"
#include "renderer/frame/passes/trace_lights.h"
#include "server/replay_token.h"

namespace helio {
namespace {

constexpr double kProgressInterval = 0.25;

std::uint64_t pixels(const RenderSettings& settings) {
  return std::uint64_t(settings.width) * std::uint64_t(settings.height);
}

}  // namespace

std::uint64_t film_bytes(const RenderSettings& settings) {
  std::uint64_t film = pixels(settings) * (Film::bytes_per_pixel(film_state(settings)) + InvalidCounts::kBytesPerPixel);
  if (settings.reprojection.mapping == ReprojectionMapping::forward) film += pixels(settings) * kForwardMapBytes;
  if (!caches_light_vertices(settings.integrator)) return film;
  return film + LightVertexSource::most_bytes(path_settings(settings));
}

Result<std::shared_ptr<Rendering>> Rendering::create(const Resources& resources, SceneLease scene,
                                                     const RenderSettings& settings, const Budget& budget,
                                                     RenderRank rank, FramePublisher::Tiles tiles, unsigned channels) {
  std::shared_ptr<Rendering> rendering(new Rendering(resources));
  rendering->scenes_->current = std::move(scene);
  if (const Status fits = rendering->resize(settings); !fits.ok()) return fits.error();
  rendering->publisher_ = std::make_shared<FramePublisher>(
      tiles, [scenes = rendering->scenes_](const FrameBegin& frame, const InvalidSample& sample) {
        const auto snapshot = frame.scene.lock();
        const std::lock_guard lock(scenes->mutex);
        if (scenes->current->snapshot == snapshot) return make_replay_token(*scenes->current, frame, sample);
        const auto before = scenes->before.lock();
        return before && before->snapshot == snapshot ? make_replay_token(*before, frame, sample) : std::string();
      });
  RenderLoopOptions options;
  options.channels = channels;
  options.publish_passes = tiles == FramePublisher::Tiles::all;
  rendering->loop_ = std::make_unique<RenderLoop>(resources.engine, rendering->scene().snapshot, settings, budget, rank,
                                                  rendering->publisher_, options);
  return rendering;
}

const LoadedScene& Rendering::scene() const {
  const std::lock_guard lock(scenes_->mutex);
  return *scenes_->current;
}

std::uint64_t Rendering::switch_scene(SceneLease scene, RenderLoop::Update update) {
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

Status Rendering::resize(const RenderSettings& settings) {
  const std::uint64_t bytes = film_bytes(settings);
  if (bytes == film_memory_.bytes()) return ok_status();
  // The film that is replaced goes first, so that its bytes count as free.
  const std::uint64_t before = film_memory_.bytes();
  film_memory_.release();
  auto memory = resources_.memory.reserve(bytes, fmt::format("a film of {} x {}", settings.width, settings.height));
  if (memory) {
    film_memory_ = std::move(*memory);
    return ok_status();
  }
  auto restored = resources_.memory.reserve(before, "the film");
  if (restored) film_memory_ = std::move(*restored);
  return memory.error();
}

Status Rendering::reserve_queue(const RenderSettings& settings, const TileFormat& format) {
  auto memory = resources_.memory.reserve(2 * pixels(settings) * format.bytes_per_pixel(), "the queue of a stream");
  if (!memory) return memory.error();
  queue_memory_ = std::move(*memory);
  return ok_status();
}

void Rendering::report_progress(const std::shared_ptr<OutboundStream>& stream) {
  report_progress_later(stream, -1);
}

void Rendering::report_progress_later(std::weak_ptr<OutboundStream> stream, double seconds_told) {
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
