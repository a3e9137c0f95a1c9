// Camera paths that draw on the light vertices of a whole pass (light_vertex_cache.h).
//
// lvc (Davidovic et al. 2014, section 4.2): every camera vertex is joined to `connections` light vertices, drawn evenly
// from all V of them: each stands for V / (connections x light paths) of what a light path of its own would bring. They
// are drawn by way of a few hundred that a group of camera paths has in common, for to fetch them costs as much as to
// join them. What the camera path meets and light samples are as in bidirectional_camera_paths.h; light paths were
// joined to the camera when they were traced.
//
// vcm (Georgiev et al. 2012, "Light Transport Simulation with Vertex Connection and Merging"): besides, light vertices
// within the radius r of a camera vertex are merged with it, as if they had arrived there: the radiance that they leave
// is a density estimate over the disc of area pi r^2. That is biased, by the light's and the surface's variation within
// r, and vanishes with r.
//
// photon (Hachisuka et al. 2008; Knaus and Zwicker 2011): nothing but merging, unweighted, at every vertex as far as
// deltas lead; what the path meets on the way counts in full.
#include <numbers>

#include "renderer/trace/integrators/bidirectional_camera_paths.h"
#include "renderer/trace/paths/light_vertex_cache.h"

namespace helio {

namespace {

template <typename Recorder>
class CachedKernel : public BidirectionalCameraPaths<CachedKernel<Recorder>, Recorder> {
  using Base = BidirectionalCameraPaths<CachedKernel<Recorder>, Recorder>;

 public:
  explicit CachedKernel(const WindowTask& task)
      : Base(task, task.lights->counts()),
        cache_(*task.lights),
        photons_alone_(task.settings.integrator == Integrator::photon),
        connections_(photons_alone_ || cache_.vertices() == 0 ? 0 : task.settings.light_cache.connections),
        share_(double(cache_.vertices()) / (double(connections_) * double(cache_.paths()))),
        per_area_(1 / (std::numbers::pi * cache_.radius() * cache_.radius() * double(cache_.paths()))) {}

 private:
  friend Base;
  friend CameraPathKernel<CachedKernel, Recorder>;
  friend PathKernelBase<CachedKernel, Recorder>;
  using Base::block_bias_, Base::counts_, Base::group_, Base::instance_name, Base::join_to, Base::paths_,
      Base::reversed_index_, Base::scene_, Base::task_, Base::recorder_;

  void prepare_paths(int count) {
    Base::start_camera_paths(count);
    if (connections_ > 0) draw_partners();
  }

  // One of each of as many equal parts of the cache.
  void draw_partners() {
    const std::size_t all = cache_.vertices(), count = std::min(all, kMostPartners);
    const std::uint32_t key =
        combine_hash(pixel_key(group_.pixel_x[0] / kPathGroupSize, group_.pixel_y[0] / kPathGroupSize, task_.range.half,
                               task_.settings.seed) ^
                         0x13198a2eu,
                     reversed_index_);
    const auto draw = [&](std::size_t k) {
      const double u = unit_float(combine_hash(key, std::uint32_t(k)));
      return std::min(std::size_t((double(k) + u) / double(count) * double(all)), all - 1);
    };
    constexpr std::size_t kAhead = 16;
    for (std::size_t k = 0; k < std::min(kAhead, count); ++k) cache_.expect_vertex(draw(k));
    partners_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      if (k + kAhead < count) cache_.expect_vertex(draw(k + kAhead));
      partners_.push_back(cache_.load(draw(k)));
    }
  }

  bool samples_lights(int vertex) const { return !photons_alone_ && Base::samples_lights(vertex); }
  // A camera path that goes on was sent there by deltas alone, which nothing is merged with.
  bool ends_with(const BsdfSample& sample) const { return photons_alone_ && !sample.delta; }
  // Most of a search is waiting for memory.
  void look_ahead(int j, int active) const {
    constexpr int kRuns = 12, kPoints = 6;
    if (!(counts_.merging > 0)) return;
    if (j == 0) {
      for (int k = 0; k < std::min(kRuns, active); ++k) cache_.expect(place_of(k));
    }
    if (j + kRuns < active) cache_.expect(place_of(j + kRuns));
    if (j + kPoints < active) cache_.expect_points(place_of(j + kPoints));
  }
  // Where the path will be merged; anywhere for one that leaves the scene.
  V3f place_of(int j) const {
    const std::uint32_t i = group_.active[j];
    return group_.hits[i].valid() ? group_.rays[i].origin + group_.rays[i].direction * group_.hits[i].t : V3f(0, 0, 0);
  }
  float environment_weight(int vertex, std::uint32_t i) {
    return photons_alone_ ? 1.0f : Base::environment_weight(vertex, i);
  }
  float emission_weight(int vertex, std::uint32_t i, std::uint32_t emitter, const Rgb& radiance, float distance,
                        float cos_light) {
    return photons_alone_ ? 1.0f : Base::emission_weight(vertex, i, emitter, radiance, distance, cos_light);
  }

  void join(int vertex, const CameraVertex& at) {
    const std::uint32_t i = at.path;
    if (connections_ > 0 && vertex + 2 <= task_.settings.max_segments) {
      const float u = sample_1d(group_.paths[i].key, reversed_index_, kSelection + std::uint32_t(vertex));
      for (int k = 0; k < connections_; ++k) {
        const double drawn = (double(k) + double(u)) / connections_ * double(partners_.size());
        const LightVertex& light = partners_[std::min(std::size_t(drawn), partners_.size() - 1)];
        if constexpr (Recorder::kRecordsSample) recorder_.light_vertex(i, light, instance_name(light.hit));
        join_to(vertex, at, light, nullptr, std::uint32_t(k), share_);
      }
    }
    if (counts_.merging > 0) merge(vertex, i, at.at, at.shading_point());
  }

  void merge(int vertex, std::uint32_t i, const PathVertex& at, const ShadingPoint* point) {
    // A disc may hold all that a lamp has sent out.
    if (task_.cancel.cancelled()) return;
    PathState& path = group_.paths[i];
    const V3f to_camera = -at.arrived;
    Rgb sum(0, 0, 0), outer_less_inner(0, 0, 0);
    int merged = 0;
    cache_.for_each_near(at.surface.position, [&](const LightVertexCache::Record& light) {
      if (vertex + light.depth > task_.settings.max_segments) return;
      const V3f to_light = -light.direction;
      const float arriving = at.cosine(to_light);
      if (!(arriving > 0)) return;
      const BsdfBothWays both = photons_alone_
                                    ? BsdfBothWays{at.scatter(scene_, to_camera, to_light, point, to_camera), {}}
                                    : at.scatter_both_ways(scene_, to_camera, to_light, point);
      const BsdfValue& value = both.there;
      if (is_black(value.f_cos)) return;
      double weight = 1;
      if (!photons_alone_)
        weight = weight_of_merging(paths_.mis[i], light.mis(), both.back.pdf_w, value.pdf_w, counts_);
      const Rgb brought = light.throughput * value.f_cos * float(weight / arriving);
      sum += brought;
      ++merged;
      const V3f off = light.position() - at.surface.position;
      const bool inner = dot(off, off) < 0.5 * cache_.radius() * cache_.radius();
      outer_less_inner += inner ? brought * -1.0f : brought;
    });
    recorder_.merged(i, merged, path.beta * sum * float(per_area_));
    path.radiance += path.beta * sum * float(per_area_);
    // The whole disc less the inner half of its area, which counts twice: where the bias grows as the radius does, as
    // along edges, which make most of it, 1 - 1 / sqrt(2) of the bias.
    const double bias = 3.41 * double(luminance(path.beta * outer_less_inner)) * per_area_;
    if (std::isfinite(bias)) block_bias_ += bias;
  }

  // Dimensions beyond all others.
  static constexpr std::uint32_t kSelection = 0x40000;

  static constexpr std::size_t kMostPartners = 512;

  const LightVertexCache& cache_;
  std::vector<LightVertex> partners_;  // of the group in flight
  const bool photons_alone_;
  const int connections_;
  const double share_, per_area_;
};

}  // namespace

bool run_cached_kernel(const WindowTask& task, TraceStats& stats) {
  return CachedKernel<NoRecorder>(task).run(stats);
}

bool run_cached_sample_trace_kernel(const WindowTask& task) {
  TraceStats stats;
  return CachedKernel<SampleRecorder>(task).run(stats);
}

}  // namespace helio
