// The camera paths of every kernel but the plain one: what each vertex does, step by step, whatever the technique.
//
// Vertices are shaded in batches: what they will read is asked for ahead, then all are found, then each chooses where
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
  Late<ShadingPoint> point;  // of all that is not `lambert`
  bool lambert = false;      // scatters as Lambert has it in `frame`, by at.albedo: there is no more to know
  bool black = false;        // one-sided, seen from behind
  bool transmissive = false;
  int light = -1;         // number of its light sample in the batch; -1: nothing can light it
  Frame frame;            // its z axis is on the viewer's side, except where a volume tells its sides apart
  V3f geometric_normal;   // unit, on the side of that axis where the two agree
  V3f wo;                 // to where the path came from, in the frame
  V3f light_normal;       // what the light sampler is told
  BsdfSample sample;      // where the path goes on

  const ShadingPoint* shading_point() const { return point.get(); }
  bool is_pure_delta() const { return lambert ? is_black(at.albedo) : point->bsdf().is_pure_delta(); }
  BsdfValue evaluate(const V3f& wi) const {
    return lambert ? evaluate_lambert(at.albedo, wo, wi) : point->bsdf().evaluate(wi);
  }
};

struct CameraVertexBatch {
  // Enough to cover the way to memory, few enough for the first-level cache.
  static constexpr int kCapacity = 32;

  CameraVertex vertices[kCapacity];
  int count = 0;
  LightSampler::Query queries[kCapacity];
  LightSample lights[kCapacity];
  int lit = 0;
};

// Kernel derives from this and has, beyond what PathKernelBase asks for,
//   void light(int vertex, const CameraVertex&, const LightSample&)   adds what the sample of a light brings
// and, where the defaults below do not suit its techniques, its own
//   static constexpr bool kJoinsVertices             vertices are looked at along other directions than the path's
//   void arrived(int vertex, const CameraVertex&)    before anything is added
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

  static constexpr bool kJoinsVertices = false;
  void arrived(int, const CameraVertex&) {}
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
    int survivors = 0;
    for (int first = 0; first < active;) {
      const int end = end_of_batch(vertex, first, active);
      fetch_ahead(first, end);
      find_vertices(vertex, first, end);
      choose_directions();
      sample_lights();
      for (int k = 0; k < batch_.count; ++k) {
        const CameraVertex& at = batch_.vertices[k];
        kernel().look_ahead(at.place, active);
        if (at.light >= 0) {
          if (kernel().samples_lights(vertex)) kernel().light(vertex, at, batch_.lights[at.light]);
          kernel().join(vertex, at);
        }
        if (go_on(vertex, at)) group_.active[survivors++] = at.path;
      }
      first = end;
    }
    kernel().trace_joined();
    return survivors;
  }

  // Of the batch that begins with the active path `first`. A blend is shaded alone: its parts lie where those of the
  // next blend of the thread will. So is a first vertex where a recorder follows it from event to event.
  int end_of_batch(int vertex, int first, int active) const {
    if (Recorder::kRecordsForReuse && vertex == 1) return first + 1;
    const int end = std::min(active, first + CameraVertexBatch::kCapacity);
    if (scene_.features.only_lambert) return end;
    for (int j = first; j < end; ++j) {
      const Hit& hit = group_.hits[group_.active[j]];
      if (hit.valid() && scene_.materials[scene_.part(hit).material].params.model == LobeModel::blend)
        return std::max(j, first + 1);
    }
    return end;
  }

  void fetch_ahead(int first, int end) const {
    const auto for_each_hit = [&](auto prefetch) {
      for (int j = first; j < end; ++j) {
        const Hit& hit = group_.hits[group_.active[j]];
        if (hit.valid()) prefetch(scene_, hit);
      }
    };
    for_each_hit(prefetch_corners);
    for_each_hit(prefetch_attributes);
    if (scene_.features.textures || scene_.features.normal_maps) for_each_hit(prefetch_texels);
  }

  void find_vertices(int vertex, int first, int end) {
    batch_.count = 0;
    for (int j = first; j < end; ++j) {
      CameraVertex& at = batch_.vertices[batch_.count];
      at.path = group_.active[j];
      at.place = j;
      batch_.count += find_vertex(vertex, at);
    }
  }

  // Absorption on the way to it and emission included. False: the path ends.
  bool find_vertex(int vertex, CameraVertex& at) {
    PathGroup& b = group_;
    const std::uint32_t i = at.path;
    PathState& path = b.paths[i];
    const Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    recorder_.segment(vertex, i, b);
    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }
    if (scene_.mip_mapped) b.cones[i].advance(hit.t);
    at.at.reach(scene_, ray, hit, scene_.mip_mapped ? &b.cones[i] : nullptr);
    Surface& surface = at.at.surface;
    const MaterialRecord& material = *surface.material;
    if (path.media.count > 0) path.beta *= transmittance(scene_, path.media, hit.t);
    recorder_.hit(i, hit, instance_name(hit), path.beta);
    kernel().arrived(vertex, at);
    if (material.emissive && kernel().shows_emission(vertex)) add_emission(vertex, i, hit, surface);

    at.black = material.one_sided && !surface.front;
    const bool last = at.black || vertex >= task_.settings.max_segments;
    if (last && vertex > 1 && !Recorder::kRecordsSample) return false;
    at.at.look_up(scene_);
    at.lambert = at.at.lambert || (!Kernel::kJoinsVertices && material.plain_lambert);
    const V3f to_viewer = -ray.direction;
    if (at.lambert) {
      find_lambert(to_viewer, at);
    } else {
      at.point.emplace(scene_, hit, surface, to_viewer, at.at.footprint);
      at.frame = at.point->frame;
      at.wo = at.frame.to_local(to_viewer);
      at.geometric_normal = at.point->geometric_normal();
      at.transmissive = lets_light_through(at.point->params);
    }
    if (vertex == 1) note_first_hit(at);
    tell_surface(at);
    if (last || kernel().ends_at_surfaces()) return false;
    if (!at.lambert && at.point->params.model == LobeModel::none) return false;
    at.light_normal = at.transmissive ? V3f(0, 0, 0) : surface.facing_normal();
    return true;
  }

  void find_lambert(const V3f& to_viewer, CameraVertex& at) const {
    at.point.reset();
    Surface& surface = at.at.surface;
    if (!at.at.lambert) {
      if (surface.part->smooth || surface.material->normal_mapped)
        interpolate_normal(scene_, at.at.hit, to_viewer, at.at.footprint, surface);
      at.at.albedo = evaluate_base_color(scene_, at.at.hit, at.at.footprint, surface);
    }
    at.frame = shading_frame(surface);
    at.wo = at.frame.to_local(to_viewer);
    at.geometric_normal = viewed_normal(surface);
    at.transmissive = false;
  }

  void note_first_hit(const CameraVertex& at) {
    const ShadingPoint* point = at.shading_point();
    const Rgb albedo = at.black ? Rgb(0, 0, 0) : point ? point->bsdf().albedo() : at.at.albedo;
    const V3f seen = point && point->params.mapped ? at.frame.to_world(point->params.map_normal) : at.frame.n;
    group_.first[at.path] = {albedo, seen, at.at.hit.t, at.at.hit.primitive};
  }

  void tell_surface(const CameraVertex& at) {
    if constexpr (Recorder::kRecordsSample || Recorder::kRecordsForReuse) {
      const ShadingPoint* point = at.shading_point();
      SurfaceParams lambert;
      lambert.base_color = at.at.albedo;
      recorder_.surface(at.path, at.at.surface, point ? point->params : lambert, at.frame.n, at.geometric_normal,
                        at.black);
      recorder_.scattering(point ? &point->bsdf() : nullptr);
    }
  }

  // Before the vertices are lit and joined, which may overwrite the parts of a blend.
  void choose_directions() {
    const PathGroup& b = group_;
    for (int k = 0; k < batch_.count; ++k) {
      CameraVertex& at = batch_.vertices[k];
      const int j = at.place;
      at.sample = at.lambert ? sample_lambert(at.at.albedo, at.wo, V3f(b.local_x[j], b.local_y[j], b.local_z[j]))
                             : at.point->bsdf().sample(b.lobe[j], V2f(b.bsdf_x[j], b.bsdf_y[j]));
      recorder_.scatter(at.path, at.sample, at.frame);
    }
  }

  // One for each vertex that a light may light.
  void sample_lights() {
    const PathGroup& b = group_;
    batch_.lit = 0;
    for (int k = 0; k < batch_.count; ++k) {
      CameraVertex& at = batch_.vertices[k];
      at.light = -1;
      if (!has_lights_ || at.is_pure_delta()) continue;
      at.light = batch_.lit++;
      // Seen from where the rays will start: rounding may have put the position itself behind its own surface, which
      // would then, if it emits, light itself.
      const V3f from = at.transmissive ? at.at.surface.position : at.at.near_side;
      batch_.queries[at.light] = {from, at.light_normal, b.select[at.place],
                                  V2f(b.light_x[at.place], b.light_y[at.place])};
    }
    lights_.sample({batch_.queries, std::size_t(batch_.lit)}, batch_.lights);
  }

  // True when the path goes on along the new ray in group_.rays.
  bool go_on(int vertex, const CameraVertex& at) {
    PathGroup& b = group_;
    const std::uint32_t i = at.path;
    const Surface& surface = at.at.surface;
    const BsdfSample& sample = at.sample;
    if (kernel().stops(vertex, sample) || !sample.valid()) return false;
    const V3f direction = at.frame.to_world(sample.wi);
    // A direction that the shading normal admits but the geometry does not would leak light.
    if (!(dot(at.geometric_normal, direction) * sample.wi.z > 0)) return false;
    PathState& path = b.paths[i];
    kernel().scattered(at, direction);
    path.beta *= sample.weight;
    path.pdf_w = sample.delta ? 0.0f : sample.pdf_w;
    path.normal = at.light_normal;
    if (scene_.mip_mapped && path.pdf_w > 0) b.cones[i].scatter(path.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && surface.material->volume)
      stats_.media_overflows += !path.media.cross(surface.part->material, at.wo.z > 0);

    Onward onward{path.beta};
    onward.goes_on = !is_black(path.beta);
    if (onward.goes_on && vertex >= task_.settings.roulette_from) play_roulette(at.place, path, onward);
    recorder_.onward(i, onward);
    if (!onward.goes_on) return false;
    Ray& ray = b.rays[i];
    ray.origin = at.at.start(direction);
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
