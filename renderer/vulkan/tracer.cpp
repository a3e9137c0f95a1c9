#include "renderer/vulkan/tracer.h"

#include <helio_shaders/path_comp.h>
#include <helio_shaders/path_rgen.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "renderer/base/check.h"
#include "renderer/base/clock.h"
#include "renderer/base/hash.h"
#include "renderer/trace/paths/path_group.h"
#include "renderer/trace/sampling/pixel_filter_sampling.h"
#include "renderer/vulkan/rt_pipeline.h"
#include "renderer/vulkan/shaders/tables/scene.h"
#include "renderer/vulkan/shaders/tables/task.h"

namespace helio::vulkan {
namespace {

constexpr std::uint32_t kGroupSize = 64;  // local_size_x of path.comp
// Dispatches aim at this time: nothing can end one early, so that a cancel waits for it.
constexpr double kDispatchSeconds = 0.015;
constexpr std::uint64_t kFirstSamples = 128;  // of a scene's first dispatch, before anything was measured
constexpr std::uint64_t kMostSamples = 1 << 18;
constexpr std::chrono::seconds kCompileLimit{600};

struct Push {
  std::uint64_t scene, task;
};

void store(const V3d& from, double (&to)[3]) {
  for (int k = 0; k < 3; ++k) to[k] = from[k];
}

CameraTable camera_table(const Camera& camera, std::uint64_t filter) {
  const Camera::Parts parts = camera.parts();
  CameraTable table{};
  store(parts.step_x, table.step_x);
  store(parts.step_y, table.step_y);
  store(parts.corner, table.corner);
  table.filter_scale = parts.filter.scale;
  table.filter_density = filter;
  table.filter_integral = filter + gaussian_pieces().density.size_bytes();
  table.origin = parts.origin;
  table.forward = parts.forward;
  table.right = parts.right;
  table.up = parts.up;
  table.lens_radius = parts.lens_radius;
  table.focus_distance = parts.focus_distance;
  table.flags = (parts.orthographic ? kCameraOrthographic : 0) | (parts.lens_radius > 0 ? kCameraLens : 0);
  table.filter_kind = uint(parts.filter.kind);
  table.width = camera.width();
  table.height = camera.height();
  return table;
}

// What a task was about.
struct Traced {
  const RenderScene& scene;
  const Camera& camera;
  const PathSettings& settings;
  SampleRange range;
  PixelRect window;
};

// Adds answers to the film, row-major over the window and side by side for each pixel, in index order. Samples that the
// driver has not traced to their end are traced by the processor.
void add_to_film(const Traced& task, std::span<const PathAnswer> answers, std::span<const FirstHitAnswer> first_hits,
                 Film& film, TraceStats& stats) {
  const SampleRange& range = task.range;
  const CancelToken never;
  std::size_t at = 0;
  for (int y = task.window.y0; y < task.window.y1; ++y) {
    for (int x = task.window.x0; x < task.window.x1; ++x) {
      std::uint64_t rays = 0, paths = 0;
      for (std::uint32_t sample = range.first; sample < range.first + range.count; ++sample, ++at) {
        const PathAnswer& path = answers[at];
        if (path.rays == kUnfinished) {
          trace_window(task.scene, task.camera, task.settings, {range.half, sample, 1}, {x, y, x + 1, y + 1}, never,
                       film, stats);
          continue;
        }
        rays += path.rays;
        ++paths;
        stats.shadow_rays += path.shadow_rays;
        stats.media_overflows += path.media_overflows;
        FirstHit first{Rgb(0, 0, 0), V3f(0, 0, 0), 0, kNoHit};
        if (range.half == 0) {
          const FirstHitAnswer& answer = first_hits[at];
          first = {answer.albedo, answer.normal, answer.depth, answer.primitive};
        }
        if (is_finite(path.radiance)) {
          film.half(range.half, x, y).add(path.radiance);
        } else {
          film.add_invalid(range.half, x, y);
          stats.note_invalid({x, y, range.half, sample, 0});
          if (!is_finite(first.albedo) || !is_finite(first.normal)) continue;
        }
        if (range.half == 0) first.add_to(film.features(x, y), sample == 0);
      }
      stats.rays += rays;
      stats.paths += paths;
      film.add_work(range.half, x, y, rays, paths);
    }
  }
}

std::uint32_t probe_result() {
  std::uint32_t value = 1;
  for (std::uint32_t i = 0; i < kLoopProbe; ++i) value = hash32(value);
  return value;
}

}  // namespace

Result<std::shared_ptr<Tracer>> Tracer::create(std::shared_ptr<Device> device) {
  std::shared_ptr<Tracer> tracer(new Tracer(std::move(device)));
  const GaussianPieces pieces = gaussian_pieces();
  std::vector<double> numbers(pieces.density.begin(), pieces.density.end());
  numbers.insert(numbers.end(), pieces.integral.begin(), pieces.integral.end());
  constexpr std::uint64_t kAlignment = 256;
  if (Status room = tracer->arena_.reserve(numbers.size() * sizeof(double) + kAlignment); !room)
    return std::move(room).error();
  auto filter = tracer->arena_.upload_vector(numbers, "the pixel filter");
  if (!filter) return std::move(filter).error();
  tracer->filter_ = *filter;
  return tracer;
}

const Tracer::Pipeline* Tracer::find(const ShaderFeatures& features) {
  const std::lock_guard lock(mutex_);
  const auto found = pipelines_.find(features);
  return found != pipelines_.end() ? found->second.get() : nullptr;
}

Result<const Tracer::Pipeline*> Tracer::pipeline_for(const DeviceScene& scene) {
  const ShaderFeatures& features = scene.features();
  if (const Pipeline* found = find(features)) return found;
  const std::lock_guard compiling(compile_mutex_);
  if (const Pipeline* found = find(features)) return found;
  auto made = std::make_unique<Pipeline>();
  if (device_->level() == Level::rt) {
    auto rays = make_ray_pipeline(device_, path_rgen, sizeof(Push), features);
    if (!rays) return std::move(rays).error();
    made->rays = std::move(*rays);
  } else {
    auto compute = ComputePipeline::create(device_, path_comp, sizeof(Push), features);
    if (!compute) return std::move(compute).error();
    made->compute = std::move(*compute);
  }
  // Some drivers compile at the first dispatch: one without a sample.
  auto slot = take_slot(0, false);
  if (!slot) return std::move(slot).error();
  if (auto ran = dispatch(*made, **slot, scene.address(), PathTask{}, kCompileLimit); !ran)
    return std::move(ran).error();
  give_back(std::move(*slot));
  const std::lock_guard lock(mutex_);
  return pipelines_.emplace(features, std::move(made)).first->second.get();
}

// A slot with room for the answers of so many samples.
Result<std::unique_ptr<Tracer::Slot>> Tracer::take_slot(std::uint64_t samples, bool first_hits) {
  std::unique_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      slot = std::move(free_.back());
      free_.pop_back();
    }
  }
  if (!slot) {
    auto commands = CommandSlot::create(device_);
    if (!commands) return std::move(commands).error();
    auto task = Buffer::create(device_, sizeof(PathTask), Memory::host, "the task of a dispatch");
    if (!task) return std::move(task).error();
    slot.reset(new Slot{std::move(*commands), std::move(*task), {}, {}});
  }
  const auto make_room = [&](Buffer& buffer, std::uint64_t bytes, const char* what) -> Status {
    if (buffer.bytes() >= bytes) return Unit();
    buffer = {};
    auto larger = Buffer::create(device_, std::bit_ceil(bytes), Memory::host, what);
    if (!larger) return std::move(larger).error();
    buffer = std::move(*larger);
    return Unit();
  };
  if (Status made = make_room(slot->answers, samples * sizeof(PathAnswer), "the samples of a dispatch"); !made)
    return std::move(made).error();
  if (!first_hits) return slot;
  if (Status made = make_room(slot->first_hits, samples * sizeof(FirstHitAnswer), "the first hits of a dispatch");
      !made)
    return std::move(made).error();
  return slot;
}

void Tracer::give_back(std::unique_ptr<Slot> slot) {
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(slot));
}

Status Tracer::prepare(const DeviceScene& scene) {
  auto pipeline = pipeline_for(scene);
  return pipeline ? ok_status() : Status(std::move(pipeline).error());
}

Result<double> Tracer::dispatch(const Pipeline& pipeline, Slot& slot, std::uint64_t scene, const PathTask& task,
                                std::chrono::milliseconds limit) {
  std::memcpy(slot.task.mapped().data(), &task, sizeof task);
  const Push push{scene, slot.task.address()};
  const auto bytes = std::as_bytes(std::span(&push, 1));
  const std::uint32_t threads = std::max(task.end_thread - task.first_thread, kGroupSize);
  const double started = now_s();
  Status ran = slot.commands.run(
      [&](const VolkDeviceTable&, VkCommandBuffer commands) {
        if (pipeline.rays) {
          pipeline.rays->trace(commands, bytes, threads);
        } else {
          pipeline.compute->dispatch(commands, bytes, {(threads + kGroupSize - 1) / kGroupSize, 1, 1});
        }
      },
      limit);
  if (!ran) return std::move(ran).error();
  // The queue works in order, so that before its last answer the device worked for others.
  const double ended = now_s();
  return std::max(0.0, ended - std::max(started, last_answer_.exchange(ended)));
}

Result<bool> Tracer::trace(const DeviceScene& scene, const Camera& camera, const PathSettings& settings,
                           const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                           TraceStats& stats, double* device_seconds) {
  HELIO_DCHECK(settings.integrator == Integrator::path && !film.targets() && !film.history());
  const PixelRect rect = intersect(window, film.bounds());
  if (cancel.cancelled()) return false;
  if (rect.empty() || range.count == 0) return true;
  const std::uint64_t samples = std::uint64_t(rect.area()) * range.count;
  if (samples > std::numeric_limits<std::uint32_t>::max() / 2)
    return Error{
        ErrorCode::resource_exhausted, std::to_string(samples) + " samples at once; allowed: at most 2^31", {}};
  auto pipeline = pipeline_for(scene);
  if (!pipeline) return std::move(pipeline).error();
  auto slot = take_slot(samples, range.half == 0);
  if (!slot) return std::move(slot).error();
  Slot& mine = **slot;
  PathTask task{};
  task.camera = camera_table(camera, filter_);
  task.answers = mine.answers.address();
  task.first_hits = range.half == 0 ? mine.first_hits.address() : 0;
  task.x0 = rect.x0;
  task.y0 = rect.y0;
  task.width = rect.width();
  task.height = rect.height();
  task.film_half = uint(range.half);
  task.first_sample = range.first;
  task.samples = range.count;
  task.seed_low = uint(settings.seed);
  task.seed_high = uint(settings.seed >> 32);
  task.max_segments = uint(settings.max_segments);
  task.roulette_from = uint(settings.roulette_from);
  task.roulette_rule = uint(settings.roulette);
  task.loop_probe = kLoopProbe;
  task.probe_result = probe_result();
  bool done = true;
  for (std::uint64_t first = 0; first < samples && done;) {
    const double cost = scene.sample_seconds();
    const double affordable = cost > 0 ? kDispatchSeconds / cost : double(kFirstSamples);
    const auto count = std::min(samples - first, std::uint64_t(std::clamp(affordable, 64.0, double(kMostSamples))));
    task.first_thread = uint(first);
    task.end_thread = uint(first + count);
    const auto worked = dispatch(**pipeline, mine, scene.address(), task);
    if (!worked) return worked.error();
    if (device_seconds) *device_seconds += *worked;
    // Answers that came together say little of each: the cost falls to a quarter at most at once.
    const double before = scene.sample_seconds(), measured = std::max(*worked / double(count), before / 4);
    scene.sample_seconds() = float(before > 0 ? before + 0.3 * (measured - before) : measured);
    first += count;
    done = !cancel.cancelled();
  }
  if (done)
    add_to_film({*scene.scene(), camera, settings, range, rect}, mine.answers.mapped_as<const PathAnswer>(),
                mine.first_hits.mapped_as<const FirstHitAnswer>(), film, stats);
  give_back(std::move(*slot));
  return done;
}

}  // namespace helio::vulkan
