// The path loop that the kernels share: each is a class template of its own on top of it.
//
// Paths advance together, a group at a time, one vertex per round: trace all rays, shade all hits, trace all shadow
// rays. A group is one sample of one half of the pixels of a 16x16 block of the film. With sample targets it holds
// only the pixels that need this sample. Without them it always holds the whole block, and results outside of the
// window are dropped: rays that are traced in one packet affect each other in the last bit, so that the result depends
// neither on the window nor on how the work was cut. Random numbers are drawn for a whole round in loops that
// vectorise.
#pragma once

#include <limits>
#include <memory>

#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/gbuffer/partial_coverage.h"
#include "renderer/trace/integrators/path_recorder.h"
#include "renderer/trace/paths/path_group.h"
#include "renderer/trace/paths/path_kernel.h"
#include "renderer/trace/sampling/mis.h"
#include "renderer/trace/sampling/sample_batch.h"
#include "renderer/trace/sampling/sampler.h"

namespace helio {

// Sample indices [begin, end).
struct SampleLevels {
  std::uint32_t begin = 0, end = 0;
};

// Kernel derives from this and has
//   void prepare_paths(int count)                               what paths 0 to count start with, beyond PathState
//   int shade(int vertex, int active)                           all hits and their shadow rays; leaves the paths that
//                                                               go on in group_.active and returns their number
// and may override these members of the base, where the defaults do not fit its scenes or techniques:
//   Rgb emitted(const Hit&, const Surface&) const               towards where the ray came from
//   float environment_weight(int vertex, std::uint32_t path) const, float emission_weight(...) const, void committed(),
//   std::uint64_t light_paths() const
template <typename Kernel, typename Recorder>
class PathKernelBase {
 public:
  explicit PathKernelBase(const WindowTask& task)
      : task_(task),
        scene_(task.scene),
        group_(thread_group()),
        lights_(*task.scene.lights),
        has_lights_(!lights_.empty()),
        mixed_(task),
        recorder_(task) {
    if (task.targets) find_levels();
    film_radiance_.resize(task.targets ? slots_.back() : std::size_t(task.window.area()) * task.range.count);
    if (task.range.half == 0) film_first_.resize(film_radiance_.size());
    if constexpr (Recorder::kRecordsForReuse) recorder_.make_room(film_radiance_.size());
  }

  // False when cancelled: the film is as it was.
  bool run(TraceStats& stats) {
    if constexpr (Recorder::kListsPixels) return run_list(stats);
    const PixelRect& w = task_.window;
    for (int by = w.y0 & ~(kPathGroupSize - 1); by < w.y1; by += kPathGroupSize) {
      for (int bx = w.x0 & ~(kPathGroupSize - 1); bx < w.x1; bx += kPathGroupSize) {
        const std::uint64_t rays = stats_.rays, paths = stats_.paths;
        block_bias_ = 0;
        const std::uint32_t end = task_.range.first + task_.range.count;
        for (std::uint32_t sample = task_.range.first; sample < end;) {
          const std::uint32_t until = std::min(end, place_group(bx, by, sample));
          if (group_.count == 0) sample = until;
          for (; sample < until; ++sample) {
            if (!trace_group(sample)) return false;
          }
        }
        work_.push_back({stats_.rays - rays, stats_.paths - paths, block_bias_});
      }
    }
    if constexpr (Recorder::kRecordsSample) {
      recorder_.ended(film_radiance_[0]);
    } else {
      commit();
      kernel().committed();
    }
    stats.add(stats_);
    return true;
  }

 protected:
  static PathGroup& thread_group() {
    static thread_local std::unique_ptr<PathGroup> group(new PathGroup);
    return *group;
  }

  Kernel& kernel() { return static_cast<Kernel&>(*this); }

  bool run_list(TraceStats& stats) {
    const PixelList& list = *task_.pixels;
    for (std::size_t first = 0; first < list.pixels.size(); first += kGroupPaths) {
      group_.count = int(std::min<std::size_t>(list.pixels.size() - first, kGroupPaths));
      for (int i = 0; i < group_.count; ++i) {
        group_.pixel_x[i] = list.pixels[first + std::size_t(i)].x;
        group_.pixel_y[i] = list.pixels[first + std::size_t(i)].y;
      }
      if (!trace_group(task_.range.first)) return false;
      for (int i = 0; i < group_.count; ++i) {
        const PathState& path = group_.paths[i];
        const Rgb none(std::numeric_limits<float>::quiet_NaN());
        list.radiance[first + std::size_t(i)] = is_finite(path.beta) && is_finite(path.radiance) ? path.radiance : none;
      }
    }
    stats.add(stats_);
    return true;
  }

  // Targets: the samples of the range that each pixel of the window takes, and where their results go.
  void find_levels() {
    const PixelRect& w = task_.window;
    const SampleRange& range = task_.range;
    const std::uint64_t end = std::uint64_t(range.first) + range.count;
    slots_.push_back(0);
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        const std::uint32_t from = std::max(range.first, task_.film.attempted(range.half, x, y));
        const auto to = std::uint32_t(std::min<std::uint64_t>(end, task_.targets->target(range.half, x, y)));
        levels_.push_back({from, std::max(from, to)});
        slots_.push_back(slots_.back() + (levels_.back().end - from));
      }
    }
  }

  // Number of samples that this task traces.
  std::uint64_t samples() const { return film_radiance_.size(); }

  // Of a pixel of the window.
  SampleLevels levels(std::size_t pixel) const {
    return task_.targets ? levels_[pixel] : SampleLevels{task_.range.first, task_.range.first + task_.range.count};
  }

  // Fills the group with the block's pixels that take this sample, 4x4 at a time, so that neighbours share a packet.
  // Returns the next sample index at which this set changes.
  std::uint32_t place_group(int block_x, int block_y, std::uint32_t sample) {
    constexpr int kTile = 4, kTiles = kPathGroupSize / kTile;
    PathGroup& b = group_;
    b.count = 0;
    std::uint32_t same_until = ~0u;
    for (int i = 0; i < kGroupPaths; ++i) {
      const int tile = i / (kTile * kTile), lane = i % (kTile * kTile);
      const int x = block_x + tile % kTiles * kTile + lane % kTile, y = block_y + tile / kTiles * kTile + lane / kTile;
      if (!recorder_.film_bounds(task_).contains(x, y)) continue;
      if (task_.targets) {
        if (!task_.window.contains(x, y)) continue;
        const SampleLevels own = levels_[pixel_index(x, y)];
        if (sample < own.end) same_until = std::min(same_until, sample < own.begin ? own.begin : own.end);
        if (sample < own.begin || sample >= own.end) continue;
      }
      if (task_.window.contains(x, y)) recorder_.placed(std::uint32_t(b.count));
      b.pixel_x[b.count] = x;
      b.pixel_y[b.count] = y;
      ++b.count;
    }
    return same_until;
  }

  // Traces one sample of every pixel of the group to the end of its path. False when cancelled.
  bool trace_group(std::uint32_t sample) {
    start_paths(sample);
    int active = group_.count;
    for (int vertex = 1; active > 0; ++vertex) {
      if (task_.cancel.cancelled()) return false;
      intersect(vertex, active);
      draw_random_numbers(vertex, active);
      active = kernel().shade(vertex, active);
    }
    // Kernels may leave a round early then, with half of its light.
    if (task_.cancel.cancelled()) return false;
    store(sample);
    return true;
  }

  void start_paths(std::uint32_t sample) {
    PathGroup& b = group_;
    const int count = b.count;
    const std::uint32_t index = reverse_bits(sample);
    for (int i = 0; i < count; ++i) {
      b.keys[i] = pixel_key(b.pixel_x[i], b.pixel_y[i], task_.range.half, task_.settings.seed);
    }
    sample_pairs(b.keys, count, index, 0, b.light_x, b.light_y);
    const bool lens = !task_.camera.pinhole();
    if (lens) sample_pairs(b.keys, count, index, 1, b.bsdf_x, b.bsdf_y);
    for (int i = 0; i < count; ++i) {
      const V2f lens_sample = lens ? V2f(b.bsdf_x[i], b.bsdf_y[i]) : V2f(0.5f, 0.5f);
      const CameraRay camera =
          task_.camera.generate_ray(b.pixel_x[i], b.pixel_y[i], V2f(b.light_x[i], b.light_y[i]), lens_sample);
      Ray& ray = b.rays[i];
      ray.origin = camera.origin;
      ray.direction = camera.direction;
      ray.t_max = std::numeric_limits<float>::infinity();
      ray.alpha_key = alpha_key(b.keys[i], index, 1);
      PathState& path = b.paths[i];
      path.beta = Rgb(1, 1, 1);
      path.pdf_w = 0;
      path.radiance = Rgb(0, 0, 0);
      path.eta_scale = 1;
      path.normal = V3f(0, 0, 0);
      path.key = b.keys[i];
      path.media.clear();
      b.active[i] = std::uint32_t(i);
    }
    reversed_index_ = index;
    kernel().prepare_paths(count);
    stats_.paths += std::uint64_t(count);
  }

  static std::uint32_t alpha_key(std::uint32_t key, std::uint32_t index, int segment) {
    return combine_hash(key ^ 0xa511e9b3u, index + std::uint32_t(segment) * 0x9e3779b9u);
  }

  void intersect(int vertex, int active) {
    PathGroup& b = group_;
    scene_.accel->intersect(b.rays, b.active, std::size_t(active), b.hits,
                            vertex == 1 ? RayOrder::camera : RayOrder::scattered);
    if (vertex == 1) {
      if constexpr (!Recorder::kRecordsSample) mixed_.look(b, reverse_bits(reversed_index_));
      if constexpr (Recorder::kRecordsForReuse) recorder_.arrived(b);
    }
    stats_.rays += std::uint64_t(active);
    if (task_.log) task_.log->add(b.rays, b.active, std::size_t(active), false);
  }

  void draw_random_numbers(int vertex, int active) {
    PathGroup& b = group_;
    for (int j = 0; j < active; ++j) b.keys[j] = b.paths[b.active[j]].key;
    const std::uint32_t pair = 2 * std::uint32_t(vertex), dimension = 3 * std::uint32_t(vertex);
    sample_pairs(b.keys, active, reversed_index_, pair, b.light_x, b.light_y);
    sample_pairs(b.keys, active, reversed_index_, pair + 1, b.bsdf_x, b.bsdf_y);
    // Directions of Lambert surfaces, and numbers that choose lobes: to draw both for all costs less than to ask who
    // needs them.
    cosine_hemispheres(b.bsdf_x, b.bsdf_y, active, b.local_x, b.local_y, b.local_z);
    if (lights_.needs_selection()) sample_1ds(b.keys, active, reversed_index_, dimension, b.select);
    sample_1ds(b.keys, active, reversed_index_, dimension + 1, b.lobe);
    if (vertex >= task_.settings.roulette_from) sample_1ds(b.keys, active, reversed_index_, dimension + 2, b.roulette);
  }

  void trace_shadow_rays() {
    PathGroup& b = group_;
    if (shadow_count_ == 0) return;
    stats_.rays += std::uint64_t(shadow_count_);
    stats_.shadow_rays += std::uint64_t(shadow_count_);
    scene_.accel->occluded(b.shadow_rays, std::size_t(shadow_count_), b.occluded);
    for (int k = 0; k < shadow_count_; ++k) {
      recorder_.occluded(b.shadow_path[k], b.occluded[k] != 0);
      if (!b.occluded[k]) b.paths[b.shadow_path[k]].radiance += b.shadow_radiance[k];
    }
    if (task_.log) task_.log->add(b.shadow_rays, nullptr, std::size_t(shadow_count_), true);
  }

  void add_shadow_ray(int vertex, std::uint32_t path, const V3f& origin, const V3f& direction, float t_max,
                      const Rgb& radiance) {
    PathGroup& b = group_;
    const int slot = shadow_count_++;
    Ray& ray = b.shadow_rays[slot];
    ray.origin = origin;
    ray.direction = direction;
    ray.t_max = t_max;
    ray.alpha_key = alpha_key(b.paths[path].key, reversed_index_, -vertex);
    recorder_.shadow_ray(path, t_max, radiance);
    b.shadow_radiance[slot] = radiance;
    b.shadow_path[slot] = path;
  }

  // Path i met nothing.
  void leave_scene(int vertex, std::uint32_t i) {
    PathGroup& b = group_;
    PathState& path = b.paths[i];
    const Ray& ray = b.rays[i];
    if (vertex == 1) b.first[i] = {Rgb(0, 0, 0), V3f(0, 0, 0), std::numeric_limits<float>::infinity(), kNoHit};
    if (!is_finite(ray.direction)) [[unlikely]] {
      path.radiance = Rgb(std::numeric_limits<float>::quiet_NaN());  // not traced: the film counts an invalid sample
      return;
    }
    // Add what the environment sends along the ray.
    const Rgb radiance = lights_.environment_radiance(ray.direction);
    if (is_black(radiance)) return;
    const float weight = kernel().environment_weight(vertex, i);
    recorder_.emission(i, radiance, weight);
    path.radiance += path.beta * radiance * weight;
  }

  Rgb emitted(const Hit& hit, const Surface& surface) const { return surface_emission(scene_, hit, surface); }

  std::uint32_t instance_name(const Hit& hit) const { return scene_.instance_name(hit); }

  // MIS weight of the environment that path i has met at its vertex of this number.
  float environment_weight(int, std::uint32_t i) const {
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    if (!(path.pdf_w > 0)) return 1;
    return mis_weight(path.pdf_w, lights_.pdf_w_environment(ray.origin, path.normal, ray.direction));
  }

  // MIS weight of an emitter that the path hit. cos_light: cosine between the emitter's front normal and the direction
  // back to the previous vertex.
  float emission_weight(int, std::uint32_t i, std::uint32_t emitter, const Rgb&, float distance,
                        float cos_light) const {
    const PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    if (!(path.pdf_w > 0)) return 1;
    return mis_weight(path.pdf_w,
                      lights_.pdf_w_area(ray.origin, path.normal, ray.direction, emitter, distance, cos_light));
  }

  // Adds what the surface that path i met emits.
  void add_emission(int vertex, std::uint32_t i, const Hit& hit, const Surface& surface) {
    PathState& path = group_.paths[i];
    const Ray& ray = group_.rays[i];
    const std::uint32_t emitter = scene_.emitter(hit, *surface.part);
    const float cos_light = -dot(surface.geometric_normal, ray.direction);
    const Rgb radiance = kernel().emitted(hit, surface);
    if (is_black(radiance)) return;
    const float weight =
        emitter != kNoHit ? kernel().emission_weight(vertex, i, emitter, radiance, hit.t, cos_light) : 1.0f;
    recorder_.emission(i, radiance, weight);
    path.radiance += path.beta * radiance * weight;
  }

  // Value of InvalidSample::light_paths.
  static std::uint64_t light_paths() { return 0; }

  // Called after the task's samples were added to the film.
  void committed() {}

  std::size_t pixel_index(int x, int y) const {
    const PixelRect& w = task_.window;
    return std::size_t(y - w.y0) * std::size_t(w.width()) + std::size_t(x - w.x0);
  }

  std::size_t result_index(int x, int y, std::uint32_t sample) const {
    const std::size_t pixel = pixel_index(x, y);
    if (task_.targets) return slots_[pixel] + (sample - levels_[pixel].begin);
    return pixel * task_.range.count + (sample - task_.range.first);
  }

  void store(std::uint32_t sample) {
    if constexpr (Recorder::kListsPixels) return;
    for (int i = 0; i < group_.count; ++i) {
      const int x = group_.pixel_x[i], y = group_.pixel_y[i];
      if (!task_.window.contains(x, y)) continue;
      const std::size_t slot = result_index(x, y, sample);
      const PathState& path = group_.paths[i];
      // A throughput that is not finite makes the sample invalid, even where the path met no light afterwards.
      film_radiance_[slot] = is_finite(path.beta) ? path.radiance : Rgb(std::numeric_limits<float>::quiet_NaN());
      if (task_.range.half == 0) film_first_[slot] = group_.first[i];
      if constexpr (Recorder::kRecordsForReuse) recorder_.store(slot, std::uint32_t(i), path.radiance);
    }
  }

  void commit() {
    const PixelRect& w = task_.window;
    auto work = work_.begin();
    for (int by = w.y0 & ~(kPathGroupSize - 1); by < w.y1; by += kPathGroupSize) {
      for (int bx = w.x0 & ~(kPathGroupSize - 1); bx < w.x1; bx += kPathGroupSize, ++work) {
        task_.film.add_work(task_.range.half, std::max(bx, w.x0), std::max(by, w.y0), work->rays, work->paths);
        if (work->bias != 0)
          task_.film.add_merging_bias(task_.range.half, std::max(bx, w.x0), std::max(by, w.y0), work->bias);
      }
    }
    stats_.rays += mixed_.rays();
    const SampleRange& range = task_.range;
    const bool centres = task_.film.history() && task_.film.history()->has_centres();
    std::size_t slot = 0;
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        HalfPixel& pixel = task_.film.half(range.half, x, y);
        PixelFeatures& features = task_.film.features(x, y);
        const std::size_t index = pixel_index(x, y);
        const SampleLevels own = levels(index);
        const std::uint32_t mixed = mixed_.any() ? mixed_.first(index) : PartialCoverage::kNone;
        for (std::uint32_t sample = own.begin; sample < own.end; ++sample, ++slot) {
          if (sample == mixed) [[unlikely]]
            stats_.dropped += mixed_.tell(x, y, sample);
          // Until its first fresh sample a carried pixel has the features of its primary hit; they go here.
          if (range.half == 0 && sample == 0 && centres) features = {};
          if (is_finite(film_radiance_[slot])) {
            pixel.add(film_radiance_[slot]);
            if constexpr (Recorder::kRecordsForReuse) recorder_.commit(slot, range.half, sample, pixel.count, x, y);
          } else {
            task_.film.add_invalid(range.half, x, y);
            stats_.note_invalid({x, y, range.half, sample, kernel().light_paths()});
            if (!is_finite_hit(range.half, slot)) continue;
          }
          // Features come from half A alone, so that their order of summation is fixed.
          if (range.half == 0) film_first_[slot].add_to(features, sample == 0);
        }
      }
    }
  }

  // Whether the features of an invalid sample may enter the film.
  bool is_finite_hit(int half, std::size_t slot) const {
    return half == 0 && is_finite(film_first_[slot].albedo) && is_finite(film_first_[slot].normal);
  }

  const WindowTask& task_;
  const SceneData& scene_;
  PathGroup& group_;
  const LightSampler& lights_;
  const bool has_lights_;
  int shadow_count_ = 0;
  std::uint32_t reversed_index_ = 0;  // of the sample in flight
  TraceStats stats_;
  std::vector<Rgb> film_radiance_;
  std::vector<FirstHit> film_first_;
  std::vector<BlockWork> work_;  // of the window's blocks, row-major
  double block_bias_ = 0;        // BlockWork::bias of the one in hand; of kernels that merge
  // With targets, of the window's pixels, row-major: their samples, and where in film_radiance_ these begin.
  std::vector<SampleLevels> levels_;
  std::vector<std::size_t> slots_;
  PartialCoverage mixed_;
  [[no_unique_address]] Recorder recorder_;
};

}  // namespace helio
