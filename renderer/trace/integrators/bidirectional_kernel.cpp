// Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994): every camera path of a group has a
// light path of its own, and is joined to it at every pair of vertices. Light paths are joined to the camera as well,
// and land on any pixel (splats).
//
// A path of s light and t camera vertices, s + t - 1 segments, by how it is made:
//   s = 0         the camera path meets a light          pdf of s = 1 (LightSampler::pdf_w_*) and of emission
//   s = 1, t > 1  next-event estimation                   emission density, camera vertex's BSDF both ways
//   s > 1, t > 1  a light vertex is joined to a camera's  both vertices' BSDFs both ways
//   s > 1, t = 1  a light vertex is joined to the camera  camera's density, light vertex's BSDF both ways
// Lights seen directly (one segment) have s = 0 alone. Delta surfaces are joined to nothing; delta lights are not met.
//
// Light path number n of a block of the film is sample n of a sequence of the block's own (sampler.h), so that the
// light paths of neighbouring pixels are spread evenly over the lights.
#include <algorithm>

#include "renderer/trace/integrators/bidirectional_camera_paths.h"
#include "renderer/trace/integrators/direction_recorder.h"
#include "renderer/trace/paths/splat_batch.h"
#include "renderer/trace/paths/splat_connection.h"

namespace helio {

namespace {

// A camera path's light path, and the numbers that it is made of.
struct PairedPaths {
  LightBatch batch;
  LightPaths lights;
};

template <typename Recorder>
class BidirectionalKernel : public BidirectionalCameraPaths<BidirectionalKernel<Recorder>, Recorder> {
  using Base = BidirectionalCameraPaths<BidirectionalKernel<Recorder>, Recorder>;

 public:
  explicit BidirectionalKernel(const WindowTask& task)
      : Base(task, {light_paths_of(task)}),
        pairs_(thread_pairs()),
        tiles_(task.film.light_tiles().get()),
        light_settings_(settings_of_light_paths(task.settings)) {}

 private:
  friend Base;
  friend CameraPathKernel<BidirectionalKernel, Recorder>;
  friend PathKernelBase<BidirectionalKernel, Recorder>;
  using Base::camera_, Base::counts_, Base::group_, Base::has_lights_, Base::instance_name, Base::join_to,
      Base::light_only_, Base::paths_, Base::reversed_index_, Base::samples, Base::scene_, Base::shows, Base::squares_,
      Base::squares_of_rays_, Base::stats_, Base::task_, Base::technique_, Base::trace_rays, Base::recorder_;

  // That a sample of every pixel comes with.
  static double light_paths_of(const WindowTask& task) {
    if constexpr (Recorder::kRecordsSample) return double(task.trace->sample.light_paths);
    const PixelRect region = task.settings.region.empty() ? task.film.bounds() : task.settings.region;
    const LightTiles* tiles = task.film.light_tiles().get();
    return tiles ? tiles->pixels_in(region) : double(region.area());
  }

  // Light paths end where the technique that is shown needs no more of them.
  static PathSettings settings_of_light_paths(const PathSettings& settings) {
    PathSettings own = settings;
    if (own.technique) own.max_segments = std::clamp(own.technique->light_vertices, 1, own.max_segments);
    return own;
  }

  static PairedPaths& thread_pairs() {
    static thread_local std::unique_ptr<PairedPaths> pairs(new PairedPaths);
    return *pairs;
  }

  void prepare_paths(int count) {
    trace_light_paths(count);
    if constexpr (Recorder::kRecordsSample) {
      for (std::uint32_t v = 0; v < pairs_.lights.vertices().size(); ++v) {
        const LightVertex& light = pairs_.lights.vertices()[v];
        recorder_.light_vertex(pairs_.lights.path_of(v), light, instance_name(light.hit));
      }
    }
    splat_light_paths();
    Base::start_camera_paths(count);
  }

  void trace_light_paths(int count) {
    constexpr std::uint32_t kBlockPaths = kGroupPaths;
    const std::uint32_t sample = reverse_bits(reversed_index_);
    // Numbers have 32 bits; samples beyond begin another sequence.
    const std::uint32_t era = sample / (0x80000000u / (kBlockPaths / 2));
    LightBatch& batch = pairs_.batch;
    batch.count = has_lights_ ? count : 0;
    for (int i = 0; i < batch.count; ++i) {
      const int x = group_.pixel_x[i], y = group_.pixel_y[i];
      const std::uint32_t key =
          pixel_key(x / kPathGroupSize, y / kPathGroupSize, task_.range.half, task_.settings.seed);
      batch.keys[i] = combine_hash(key ^ 0x1f83d9abu, era);
      const auto own = std::uint32_t(y % kPathGroupSize * kPathGroupSize + x % kPathGroupSize);
      batch.reversed_index[i] = reverse_bits(sample * kBlockPaths + own);
    }
    pairs_.lights.trace(scene_, light_settings_, batch, counts_, task_.cancel, stats_);
  }

  // t = 1.
  void splat_light_paths() {
    const std::vector<LightVertex>& vertices = pairs_.lights.vertices();
    const bool unweighted = light_only_ || (technique_ && technique_->unweighted);
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
      const LightVertex& vertex = vertices[v];
      if (!shows(vertex.depth + 1, 1)) continue;
      const std::uint32_t i = pairs_.lights.path_of(v);
      const std::uint32_t key = pairs_.batch.keys[i], index = pairs_.batch.reversed_index[i];
      const V2f lens = lens_sample(task_.camera, key, index, vertex.depth);
      const auto splat = connect_to_camera(scene_, camera_, vertex, pairs_.lights.point(v), lens, counts_, unweighted,
                                           Recorder::kRecordsForReuse);
      if (!splat) continue;
      if (paths_.rays.full()) trace_splats();
      film_points_[paths_.rays.count()] = {splat->camera.film_x, splat->camera.film_y, told_of(vertex, *splat)};
      if (task_.squares) {
        // A light path's share of the pixel is its try's, of which there are so many.
        const double tries = counts_.light_paths, brought = luminance(splat->radiance) / tries;
        squares_of_rays_[paths_.rays.count()] =
            rare_squares(brought, splat->weight, splat->path_tracer, task_.rare) * tries;
      }
      recorder_.splat(i, paths_.rays.count(), vertex, *splat);
      add_splat_ray(vertex, *splat, key, index, i, paths_.rays);
    }
    trace_splats();
  }

  // Of the light that the camera sees.
  static ToldLight told_of(const LightVertex& vertex, const SplatConnection& splat) {
    if constexpr (!Recorder::kRecordsForReuse) return {};
    return {pack_direction<DirectionReservoir::kAxisBits>(-vertex.arrived), splat.share};
  }

  void trace_splats() {
    trace_rays([&](int ray, std::uint32_t path, const Rgb& radiance) {
      recorder_.ray_arrived(ray);
      const FilmPoint& at = film_points_[ray];
      // A light path is the window's whose pixel's camera path it goes with.
      if (!task_.window.contains(group_.pixel_x[path], group_.pixel_y[path])) return;
      arrivals_.push_back({at, radiance, group_.pixel_x[path], group_.pixel_y[path], reverse_bits(reversed_index_)});
      if (task_.squares)
        camera_.for_each_pixel(at.x, at.y, [&](int x, int y, double share) {
          squares_.push_back({x, y, Base::that_enters(squares_of_rays_[ray] * share)});
        });
    });
    recorder_.rays_traced();
  }

  // s > 1: to the vertices of the camera path's own light path.
  void join(int vertex, const CameraVertex& at) {
    for (std::uint32_t v = pairs_.lights.last(int(at.path)); v != kNoVertex;) {
      const LightVertex& light = pairs_.lights.vertices()[v];
      join_to(vertex, at, light, pairs_.lights.point(v), std::uint32_t(light.depth), 1);
      v = light.previous;
    }
  }

  // The window's light paths are as many as its samples.
  void committed() {
    SplatBatch splats(*task_.film.splats(), task_.range.half, stats_);
    for (const Arrival& arrival : arrivals_) {
      const InvalidSample sample{arrival.x, arrival.y, task_.range.half, arrival.sample, Base::light_paths()};
      camera_.for_each_pixel(arrival.at.x, arrival.at.y, [&](int x, int y, double share) {
        // What other tiles' camera paths bring is all there is.
        if (!tiles_ || tiles_->on(x, y)) splats.add(arrival.splat(x, y, share), sample);
      });
    }
    splats.finish(samples());
    if (task_.squares) task_.squares->add(task_.range.half, squares_, samples());
    stats_.light_paths += samples();
  }

  struct FilmPoint {
    double x, y;
    ToldLight told;
  };
  // Of a light path at the camera.
  struct Arrival {
    FilmPoint at;
    Rgb radiance;
    std::int32_t x, y;  // of the pixel whose sample it goes with
    std::uint32_t sample;

    Splat splat(int x, int y, double share) const { return {x, y, radiance * float(share), at.told}; }
  };

  PairedPaths& pairs_;
  const LightTiles* tiles_;                           // null: light paths everywhere
  const PathSettings light_settings_;                 // of light paths
  FilmPoint film_points_[ConnectionRays::kCapacity];  // by ray
  std::vector<Arrival> arrivals_;
};

}  // namespace

bool run_bidirectional_sample_trace_kernel(const WindowTask& task) {
  TraceStats stats;
  return BidirectionalKernel<SampleRecorder>(task).run(stats);
}

bool run_bidirectional_kernel(const WindowTask& task, TraceStats& stats) {
  // What later pictures draw on, as path_kernel_recording.cpp has it; the same bits.
  const bool keeps = task.film.history() && !task.scene.features.only_lambert;
  return keeps ? BidirectionalKernel<DirectionRecorder>(task).run(stats)
               : BidirectionalKernel<NoRecorder>(task).run(stats);
}

}  // namespace helio
