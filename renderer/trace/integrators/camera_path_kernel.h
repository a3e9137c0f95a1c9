// The camera paths of every kernel but the plain one: what each vertex does, step by step, whatever the technique.
//
// Vertices are shaded in batches: what they will read is asked for first, then all are begun, then each chooses where
// it goes on, then lights are chosen for all, and last each is lit, joined and left. Batches and their vertices follow
// the order of the paths, so that the rays that leave do too.
//
// Recorder: as path_recorder.h has them.
#pragma once

#include <algorithm>
#include <memory>

#include "renderer/trace/integrators/path_kernel_base.h"
#include "renderer/trace/paths/path_vertex.h"
#include "renderer/trace/scene/surface_prefetch.h"

namespace helio {

// A vertex of a camera path in hand.
struct CameraVertex {
  std::uint32_t path = 0;  // in the group
  int place = 0;           // of the path in PathGroup::active, which its random numbers go by
  PathVertex at;
  Late<ShadingPoint> point;  // of all that is not Lambert
  bool black = false;        // one-sided, seen from behind
  bool transmissive = false;
  bool receives = false;  // a light or another vertex may light it
  int light = -1;         // number of its light sample in the batch; -1: none was drawn
  Frame frame;            // its z axis is on the viewer's side, except where a volume tells its sides apart
  V3f geometric_normal;   // unit, on the side of that axis where the two agree
  V3f wo;                 // to where the path came from, in the frame
  V3f light_normal;       // what the light sampler is told
  BsdfSample sample;      // where the path goes on

  const ShadingPoint* shading_point() const { return point.get(); }
  bool is_pure_delta() const { return at.lambert ? is_black(at.albedo) : point->bsdf().is_pure_delta(); }
  BsdfValue evaluate(const V3f& wi) const {
    return at.lambert ? evaluate_lambert(at.albedo, wo, wi) : point->bsdf().evaluate(wi);
  }
};

struct CameraVertexBatch {
  // Enough to cover the way to memory. A Lambert vertex touches some 400 bytes of its 2.6 KB.
  static constexpr int kCapacity = 32;

  CameraVertex vertices[kCapacity];
  int count = 0;
  LightSampler::Query queries[kCapacity];
  LightSample lights[kCapacity];
  int light_count = 0;  // of queries and lights
};

// Kernel derives from this and has, beyond what PathKernelBase asks for,
//   void light(int vertex, const CameraVertex&, const LightSample&)   adds what the sample of a light brings
// and, where the defaults below do not suit its techniques, its own
//   void arrived(int vertex, std::uint32_t path, const PathVertex&)    before anything is added
//   bool shows_emission(int vertex) const            surfaces' alone
//   bool ends_at_surfaces() const                    what a surface sends on does not count
//   bool samples_lights(int vertex) const
//   void look_ahead(int place, int active) const     before the vertex of this place is lit and joined
//   void join(int vertex, const CameraVertex&)       to other vertices
//   bool stops(int vertex, const BsdfSample&) const  does not go on
//   void scattered(const CameraVertex&, const V3f& direction)
//   void trace_joined()                              at the end of a round: the rays of light() and join()
template <typename Kernel, typename Recorder>
class CameraPathKernel : public PathKernelBase<Kernel, Recorder> {
  using Base = PathKernelBase<Kernel, Recorder>;

 protected:
  using Base::Base;
  friend Base;
  using Base::add_emission, Base::alpha_key, Base::group_, Base::has_lights_, Base::instance_name, Base::kernel,
      Base::leave_scene, Base::lights_, Base::recorder_, Base::reversed_index_, Base::scene_, Base::shadow_count_,
      Base::stats_, Base::task_;

  void arrived(int, std::uint32_t, const PathVertex&) {}
  bool shows_emission(int) const { return true; }
  bool ends_at_surfaces() const { return false; }
  bool samples_lights(int) const { return true; }
  void look_ahead(int, int) const {}
  void join(int, const CameraVertex&) {}
  bool stops(int, const BsdfSample&) const { return false; }
  void scattered(const CameraVertex&, const V3f&) {}
  void trace_joined() { Base::trace_shadow_rays(); }

  void start_cones(int count) {
    if (scene_.mip_mapped) std::fill_n(group_.cones, count, task_.camera.cone());
  }

  int shade(int vertex, int active) {
    shadow_count_ = 0;
    int survivors = 0, fetched = 0, looked_at = 0;
    for (int first = 0; first < active;) {
      if (first >= fetched) {
        fetched = std::min(active, first + CameraVertexBatch::kCapacity);
        fetch(first, fetched);
      }
      const int end = end_of_batch(vertex, first, active);
      begin_vertices(vertex, first, end);
      choose_directions();
      sample_lights(vertex);
      for (int k = 0; k < batch_.count; ++k) {
        const CameraVertex& v = batch_.vertices[k];
        for (; looked_at <= v.place; ++looked_at) kernel().look_ahead(looked_at, active);
        if (v.light >= 0) kernel().light(vertex, v, batch_.lights[v.light]);
        if (v.receives) kernel().join(vertex, v);
        if (go_on(vertex, v)) group_.active[survivors++] = v.path;
      }
      for (; looked_at < end; ++looked_at) kernel().look_ahead(looked_at, active);
      first = end;
    }
    kernel().trace_joined();
    return survivors;
  }

  // The end of the batch that begins with the active path `first`. A blend is shaded alone: blends within blends refer
  // to parts that lie where those of the thread's next blend will. So is a first vertex that a recorder follows from
  // event to event.
  int end_of_batch(int vertex, int first, int active) const {
    if (Recorder::kFollowsVertices && vertex == 1) return first + 1;
    const int end = std::min(active, first + CameraVertexBatch::kCapacity);
    if (scene_.features.only_lambert) return end;
    for (int j = first; j < end; ++j) {
      const Hit& hit = group_.hits[group_.active[j]];
      if (hit.valid() && scene_.materials[scene_.part(hit).material].params.model == LobeModel::blend)
        return std::max(j, first + 1);
    }
    return end;
  }

  // Asks for what the hits of these active paths will read.
  void fetch(int first, int end) const {
    prefetch_hits(scene_, group_.hits, group_.active + first, end - first);
  }

  void begin_vertices(int vertex, int first, int end) {
    batch_.count = 0;
    for (int j = first; j < end; ++j) {
      CameraVertex& v = batch_.vertices[batch_.count];
      v.path = group_.active[j];
      v.place = j;
      batch_.count += begin_vertex(vertex, v);
    }
  }

  // Adds what the vertex emits or the scene's surroundings send, and works out how it scatters. False: the path ends.
  bool begin_vertex(int vertex, CameraVertex& v) {
    PathGroup& b = group_;
    const std::uint32_t i = v.path;
    PathState& path = b.paths[i];
    const Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    recorder_.segment(vertex, i, b);
    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }

    if (scene_.mip_mapped) b.cones[i].advance(hit.t);
    v.at.reach(scene_, ray, hit, scene_.mip_mapped ? &b.cones[i] : nullptr);
    Surface& surface = v.at.surface;
    const MaterialRecord& material = *surface.material;
    // Absorb what the medium takes along the segment.
    if (path.media.count > 0) path.beta *= transmittance(scene_, path.media, hit.t);
    recorder_.hit(i, hit, instance_name(hit), path.beta);
    kernel().arrived(vertex, i, v.at);
    // Add what the surface emits.
    if (material.emissive && kernel().shows_emission(vertex)) add_emission(vertex, i, hit, surface);

    // Evaluate the material.
    v.black = material.one_sided && !surface.front;
    const bool last = v.black || vertex >= task_.settings.max_segments;
    if (last && vertex > 1 && !Recorder::kRecordsSample) return false;
    v.at.look_up(scene_);
    const V3f to_viewer = -ray.direction;
    if (v.at.lambert) {
      find_lambert(to_viewer, v);
    } else {
      v.point.emplace(scene_, hit, surface, to_viewer, v.at.footprint, v.at.flat ? nullptr : &v.at.unbent);
      v.frame = v.point->frame;
      v.wo = v.frame.to_local(to_viewer);
      v.geometric_normal = v.point->geometric_normal();
      v.transmissive = lets_light_through(v.point->params);
    }
    if (vertex == 1) note_first_hit(v);
    record_surface(v);
    if (last || kernel().ends_at_surfaces()) return false;
    if (!v.at.lambert && v.point->params.model == LobeModel::none) return false;
    v.light_normal = v.transmissive ? V3f(0, 0, 0) : surface.facing_normal();
    return true;
  }

  void find_lambert(const V3f& to_viewer, CameraVertex& v) const {
    v.point.reset();
    Surface& surface = v.at.surface;
    if (!v.at.flat) surface.shading_normal = v.at.shading_normal(to_viewer);
    v.frame = shading_frame(surface);
    v.wo = v.frame.to_local(to_viewer);
    v.geometric_normal = viewed_normal(surface);
    v.transmissive = false;
  }

  void note_first_hit(const CameraVertex& v) {
    const ShadingPoint* point = v.shading_point();
    const Rgb albedo = v.black ? Rgb(0, 0, 0) : point ? point->bsdf().albedo() : v.at.albedo;
    const V3f seen = point && point->params.mapped ? v.frame.to_world(point->params.map_normal) : v.frame.n;
    group_.first[v.path] = {albedo, seen, v.at.hit.t, v.at.hit.primitive};
  }

  void record_surface(const CameraVertex& v) {
    if constexpr (Recorder::kRecordsSample || Recorder::kRecordsForReuse) {
      const ShadingPoint* point = v.shading_point();
      SurfaceParams lambert = v.at.surface.material->params;
      lambert.base_color = v.at.albedo;
      recorder_.surface(v.path, v.at.surface, point ? point->params : lambert, v.frame.n, v.geometric_normal,
                        v.black);
      recorder_.scattering(point ? &point->bsdf() : nullptr);
    }
  }

  // Samples each vertex's BSDF. It comes before vertices are lit and joined, which may overwrite the parts of a blend.
  void choose_directions() {
    const PathGroup& b = group_;
    for (int k = 0; k < batch_.count; ++k) {
      CameraVertex& v = batch_.vertices[k];
      const int j = v.place;
      v.sample = v.at.lambert ? sample_lambert(v.at.albedo, v.wo, V3f(b.local_x[j], b.local_y[j], b.local_z[j]))
                              : v.point->bsdf().sample(b.lobe[j], V2f(b.bsdf_x[j], b.bsdf_y[j]));
      recorder_.scatter(v.path, v.sample, v.frame);
    }
  }

  // Draws one light sample for each vertex of the batch that a light may light.
  void sample_lights(int vertex) {
    const PathGroup& b = group_;
    const bool draws = kernel().samples_lights(vertex);
    batch_.light_count = 0;
    for (int k = 0; k < batch_.count; ++k) {
      CameraVertex& v = batch_.vertices[k];
      v.receives = has_lights_ && !v.is_pure_delta();
      v.light = v.receives && draws ? batch_.light_count++ : -1;
      if (v.light < 0) continue;
      // Seen from where the rays will start: rounding may have put the position itself behind its own surface, which
      // would then, if it emits, light itself.
      const V3f from = v.transmissive ? v.at.surface.position : v.at.near_side;
      batch_.queries[v.light] = {from, v.light_normal, b.select[v.place],
                                  V2f(b.light_x[v.place], b.light_y[v.place])};
    }
    lights_.sample({batch_.queries, std::size_t(batch_.light_count)}, batch_.lights);
  }

  // Sets out along the chosen direction. True when the path goes on along the new ray in group_.rays.
  bool go_on(int vertex, const CameraVertex& v) {
    PathGroup& b = group_;
    const std::uint32_t i = v.path;
    const Surface& surface = v.at.surface;
    const BsdfSample& sample = v.sample;
    if (kernel().stops(vertex, sample) || !sample.valid()) return false;
    const V3f direction = v.frame.to_world(sample.wi);
    // A direction that the shading normal admits but the geometry does not would leak light.
    if (!(dot(v.geometric_normal, direction) * sample.wi.z > 0)) return false;
    PathState& path = b.paths[i];
    kernel().scattered(v, direction);
    path.beta *= sample.weight;
    path.pdf_w = sample.delta ? 0.0f : sample.pdf_w;
    path.normal = v.light_normal;
    if (scene_.mip_mapped && path.pdf_w > 0) b.cones[i].scatter(path.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && surface.material->volume)
      stats_.media_overflows += !path.media.cross(surface.part->material, v.wo.z > 0);

    Onward onward{path.beta};
    onward.goes_on = !is_black(path.beta);
    if (onward.goes_on && vertex >= task_.settings.roulette_from) play_roulette(v.place, path, onward);
    recorder_.onward(i, onward);
    if (!onward.goes_on) return false;
    Ray& ray = b.rays[i];
    ray.origin = v.at.start(direction);
    ray.direction = direction;
    ray.alpha_key = alpha_key(path.key, reversed_index_, vertex + 1);
    return true;
  }

  // Lets the path die with a probability that its throughput gives.
  void play_roulette(int place, PathState& path, Onward& onward) const {
    onward.roulette = true;
    onward.u = group_.roulette[place];
    onward.survival = survival_probability(task_.settings.roulette, path.beta * path.eta_scale);
    onward.goes_on = survives(onward.u, onward.survival);
    if (onward.goes_on) path.beta *= 1 / onward.survival;
  }

  static CameraVertexBatch& thread_batch() {
    static thread_local std::unique_ptr<CameraVertexBatch> batch(new CameraVertexBatch);
    return *batch;
  }

  CameraVertexBatch& batch_ = thread_batch();
};

}  // namespace helio
