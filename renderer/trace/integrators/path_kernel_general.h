// The kernel for everything. Vertices are shaded in batches: what they will read is asked for ahead, then each is
// found, then all are lit, then each scatters. Batches and their vertices follow the order of the paths, so that the
// rays that leave do too. Recorder: as path_recorder.h has them.
#pragma once

#include <memory>

#include "renderer/base/late.h"
#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/integrators/path_kernel_base.h"
#include "renderer/trace/scene/surface_layers.h"
#include "renderer/trace/scene/surface_prefetch.h"

namespace helio {

// A camera path at a surface that goes on from it.
struct CameraVertex {
  std::uint32_t path = 0;  // in the group
  int place = 0;           // of the path in PathGroup::active, which its random numbers go by
  Surface surface;
  Frame frame;              // its z axis is on the viewer's side, except where a volume tells its sides apart
  V3f geometric_normal;     // unit, on the side of that axis where the two agree
  V3f wo;                   // to where the path came from, in the frame
  V3f near_side;            // where rays start that leave on the side of wo
  V3f light_normal;         // what the light sampler is told
  bool transmissive = false;
  bool lambert = false;     // of `albedo`; else `bsdf` is there
  Rgb albedo{0, 0, 0};
  Late<Bsdf> bsdf;

  bool is_pure_delta() const { return lambert ? is_black(albedo) : bsdf->is_pure_delta(); }
  BsdfValue evaluate(const V3f& wi) const { return lambert ? evaluate_lambert(albedo, wo, wi) : bsdf->evaluate(wi); }
  BsdfSample sample(float u_lobe, const V2f& u) const {
    return lambert ? sample_lambert(albedo, wo, square_to_cosine_hemisphere(u)) : bsdf->sample(u_lobe, u);
  }
};

struct CameraVertices {
  // Enough to cover the way to memory, few enough for the first-level cache.
  static constexpr int kCapacity = 32;

  CameraVertex at[kCapacity];
  int count = 0;
  LightSampler::Query light_queries[kCapacity];
  LightSample lights[kCapacity];
};

template <typename Recorder>
class GeneralKernel : public PathKernelBase<GeneralKernel<Recorder>, Recorder> {
  using Base = PathKernelBase<GeneralKernel<Recorder>, Recorder>;

 public:
  using Base::Base;

 private:
  friend Base;
  using Base::add_emission, Base::add_shadow_ray, Base::alpha_key, Base::emitted, Base::group_, Base::has_lights_,
      Base::instance_name, Base::leave_scene, Base::lights_, Base::reversed_index_, Base::scene_, Base::shadow_count_,
      Base::stats_, Base::task_, Base::trace_shadow_rays, Base::recorder_;

  void prepare_paths(int count) {
    if (scene_.mip_mapped) std::fill_n(group_.cones, count, task_.camera.cone());
  }

  int shade(int vertex, int active) {
    shadow_count_ = 0;
    int survivors = 0;
    for (int first = 0; first < active;) {
      const int end = end_of_batch(vertex, first, active);
      look_ahead(first, end);
      find_surfaces(vertex, first, end);
      if (has_lights_) {
        sample_lights();
        for (int k = 0; k < vertices_.count; ++k) light(vertex, vertices_.at[k], vertices_.lights[k]);
      }
      for (int k = 0; k < vertices_.count; ++k) {
        if (scatter(vertex, vertices_.at[k])) group_.active[survivors++] = vertices_.at[k].path;
      }
      first = end;
    }
    trace_shadow_rays();
    return survivors;
  }

  // Of the batch that begins with the active path `first`. A blend is shaded alone: its parts lie where those of the
  // next blend of the thread will. So is the first vertex where a recorder follows it from event to event.
  int end_of_batch(int vertex, int first, int active) const {
    if (Recorder::kRecordsForReuse && vertex == 1) return first + 1;
    const int end = std::min(active, first + CameraVertices::kCapacity);
    if (scene_.features.only_lambert) return end;
    for (int j = first; j < end; ++j) {
      const Hit& hit = group_.hits[group_.active[j]];
      if (hit.valid() && scene_.materials[scene_.part(hit).material].params.model == LobeModel::blend)
        return std::max(j, first + 1);
    }
    return end;
  }

  void look_ahead(int first, int end) const {
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

  void find_surfaces(int vertex, int first, int end) {
    vertices_.count = 0;
    for (int j = first; j < end; ++j) {
      CameraVertex& at = vertices_.at[vertices_.count];
      at.path = group_.active[j];
      at.place = j;
      vertices_.count += find_surface(vertex, at);
    }
  }

  // Emission and absorption on the way to it included. False: the path ends.
  bool find_surface(int vertex, CameraVertex& at) {
    PathGroup& b = group_;
    const std::uint32_t i = at.path;
    PathState& path = b.paths[i];
    const Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    recorder_.segment(vertex, i, group_);

    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }

    recorder_.hit(i, hit, instance_name(hit));
    at.surface = make_surface<true>(scene_, ray, hit);
    Surface& surface = at.surface;
    const MaterialRecord& material = *surface.material;
    const V3f wo = -ray.direction;

    // Absorb what the medium takes along the segment.
    if (path.media.count > 0) path.beta *= transmittance(scene_, path.media, hit.t);
    recorder_.throughput(i, path.beta);

    // Add what the surface emits.
    if (material.emissive) add_emission(vertex, i, hit, surface);

    float footprint = 0;
    if (scene_.mip_mapped) {
      b.cones[i].advance(hit.t);
      footprint = b.cones[i].footprint(dot(surface.geometric_normal, wo));
    }
    if (surface.part->smooth || material.normal_mapped) interpolate_normal(scene_, hit, wo, footprint, surface);
    const bool flip = !surface.front && !material.volume;
    at.geometric_normal = flip ? -surface.geometric_normal : surface.geometric_normal;
    at.frame = Frame(flip ? -surface.shading_normal : surface.shading_normal);
    at.wo = at.frame.to_local(wo);

    // Evaluate the material.
    const bool black = material.one_sided && !surface.front;
    const bool last = black || vertex >= task_.settings.max_segments;
    if (last && vertex > 1 && !Recorder::kRecordsSample) return false;
    if (material.plain_lambert) {
      find_lambert(vertex, hit, footprint, black, at);
      return !last;
    }
    SurfaceParams params = evaluate_material(scene_, hit, wo, footprint, surface);
    LayerParams layers;
    if (params.model == LobeModel::stack) {
      layers = evaluate_layers(scene_, hit, wo, footprint, surface, at.frame);
      params.layers = &layers;
    }
    const bool ends = last || params.model == LobeModel::none;
    at.lambert = false;
    at.bsdf.reset();
    if (!ends || vertex == 1) at.bsdf.emplace(params, at.wo);
    if (vertex == 1) {
      const Rgb albedo = black ? Rgb(0, 0, 0) : at.bsdf->albedo();
      const V3f seen = params.mapped ? at.frame.to_world(params.map_normal) : at.frame.n;
      b.first[i] = {albedo, seen, hit.t, hit.primitive};
    }
    recorder_.surface(i, surface, params, at.frame.n, at.geometric_normal, black);
    recorder_.scattering(at.bsdf.get());
    at.transmissive = lets_light_through(params);
    find_sides(ray, at);
    return !ends;
  }

  void find_lambert(int vertex, const Hit& hit, float footprint, bool black, CameraVertex& at) {
    at.lambert = true;
    at.transmissive = false;
    at.albedo = evaluate_base_color(scene_, hit, footprint, at.surface);
    if (vertex == 1) group_.first[at.path] = {black ? Rgb(0, 0, 0) : at.albedo, at.frame.n, hit.t, hit.primitive};
    if constexpr (Recorder::kRecordsSample || Recorder::kRecordsForReuse) {
      SurfaceParams params = at.surface.material->params;
      params.base_color = at.albedo;
      recorder_.surface(at.path, at.surface, params, at.frame.n, at.geometric_normal, black);
      recorder_.scattering(nullptr);
    }
    find_sides(group_.rays[at.path], at);
  }

  void find_sides(const Ray& ray, CameraVertex& at) const {
    at.light_normal = at.transmissive ? V3f(0, 0, 0) : at.surface.facing_normal();
    at.near_side = near_side_origin(at.surface, ray.direction);
  }

  // One light for each vertex of the batch.
  void sample_lights() {
    for (int k = 0; k < vertices_.count; ++k) {
      const CameraVertex& at = vertices_.at[k];
      // Seen from where the rays will start: rounding may have put the position itself behind its own surface, which
      // would then, if it emits, light itself.
      const V3f from = at.transmissive ? at.surface.position : at.near_side;
      const PathGroup& b = group_;
      vertices_.light_queries[k] = {from, at.light_normal, b.select[at.place],
                                    V2f(b.light_x[at.place], b.light_y[at.place])};
    }
    lights_.sample({vertices_.light_queries, std::size_t(vertices_.count)}, vertices_.lights);
  }

  // Weights the sample of a light against the BSDF's finding it.
  void light(int vertex, const CameraVertex& at, const LightSample& light) {
    if (at.is_pure_delta()) return;
    const std::uint32_t i = at.path;
    const PathState& path = group_.paths[i];
    const Surface& surface = at.surface;
    recorder_.light_sample(i, light);
    if (!(light.pdf_w > 0) || is_black(light.radiance)) return;
    const V3f wi = at.frame.to_local(light.direction);
    const BsdfValue value = at.evaluate(wi);
    recorder_.light_value(i, light, value);
    // A direction that the shading normal admits but the geometry does not would leak light.
    const bool consistent = dot(at.geometric_normal, light.direction) * wi.z > 0;
    if (!consistent || is_black(value.f_cos)) return;
    const float weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
    Rgb radiance = path.beta * value.f_cos * light.radiance * (weight / light.pdf_w);
    const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
    if (scene_.features.absorption)
      radiance *= shadow_transmittance(scene_, path.media, *surface.part, surface.front, wi.z > 0, light.distance);
    add_shadow_ray(vertex, i, origin_towards(surface, at.near_side, light.direction), light.direction, t_max, radiance);
  }

  // Samples the BSDF for the next direction. True when the path goes on along the new ray in group_.rays.
  bool scatter(int vertex, const CameraVertex& at) {
    PathGroup& b = group_;
    const std::uint32_t i = at.path;
    PathState& path = b.paths[i];
    const Surface& surface = at.surface;
    const BsdfSample sample = at.sample(b.lobe[at.place], V2f(b.bsdf_x[at.place], b.bsdf_y[at.place]));
    recorder_.scatter(i, sample, at.frame);
    if (!sample.valid()) return false;
    const V3f direction = at.frame.to_world(sample.wi);
    if (!(dot(at.geometric_normal, direction) * sample.wi.z > 0)) return false;
    path.beta *= sample.weight;
    path.pdf_w = sample.delta ? 0.0f : sample.pdf_w;
    path.normal = at.light_normal;
    if (scene_.mip_mapped && path.pdf_w > 0) b.cones[i].scatter(path.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && surface.material->volume)
      stats_.media_overflows += !path.media.cross(surface.part->material, at.wo.z > 0);
    recorder_.next_throughput(i, path.beta);
    if (is_black(path.beta)) return false;

    // Let the path die with a probability that its throughput gives.
    if (vertex >= task_.settings.roulette_from) {
      const float survival = survival_probability(task_.settings.roulette, path.beta * path.eta_scale);
      recorder_.roulette(i, survival, b.roulette[at.place]);
      if (!survives(b.roulette[at.place], survival)) return false;
      path.beta *= 1 / survival;
    }

    recorder_.goes_on(i);
    Ray& ray = b.rays[i];
    ray.origin = origin_towards(surface, at.near_side, direction);
    ray.direction = direction;
    ray.alpha_key = alpha_key(path.key, reversed_index_, vertex + 1);
    return true;
  }

  static CameraVertices& thread_vertices() {
    static thread_local std::unique_ptr<CameraVertices> vertices(new CameraVertices);
    return *vertices;
  }

  CameraVertices& vertices_ = thread_vertices();
};

}  // namespace helio
