// The kernel for everything: one vertex of one path after the other. Recorder: as path_recorder.h has them.
#pragma once

#include "renderer/base/late.h"
#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/integrators/path_kernel_base.h"
#include "renderer/trace/scene/surface_layers.h"

namespace helio {

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
    PathGroup& b = group_;
    shadow_count_ = 0;
    int survivors = 0;
    for (int j = 0; j < active; ++j) {
      const std::uint32_t i = b.active[j];
      if (shade_vertex(vertex, j, i)) b.active[survivors++] = i;
    }
    trace_shadow_rays();
    return survivors;
  }

  // One vertex of one path. True when the path goes on along the new ray in group_.rays[i].
  bool shade_vertex(int vertex, int j, std::uint32_t i) {
    PathGroup& b = group_;
    PathState& path = b.paths[i];
    Ray& ray = b.rays[i];
    const Hit& hit = b.hits[i];
    recorder_.segment(vertex, i, group_);

    if (!hit.valid()) {
      leave_scene(vertex, i);
      return false;
    }

    recorder_.hit(i, hit, instance_name(hit));
    Surface surface = make_surface<true>(scene_, ray, hit);
    const MaterialRecord& material = *surface.material;
    const V3f wo_world = -ray.direction;

    // Absorb what the medium takes along the segment.
    if (path.media.count > 0) path.beta *= transmittance(scene_, path.media, hit.t);

    recorder_.throughput(i, path.beta);

    // Add what the surface emits.
    if (material.emissive) add_emission(vertex, i, hit, surface);

    // Evaluate the material; the frame's z axis is on the viewer's side, except where a volume tells its sides apart.
    float footprint = 0;
    if (scene_.mip_mapped) {
      b.cones[i].advance(hit.t);
      footprint = b.cones[i].footprint(dot(surface.geometric_normal, wo_world));
    }
    if (surface.part->smooth || material.normal_mapped) {
      interpolate_normal(scene_, hit, wo_world, footprint, surface);
    }
    SurfaceParams params = evaluate_material(scene_, hit, wo_world, footprint, surface);
    const bool flip = !surface.front && !material.volume;
    const V3f normal = flip ? -surface.shading_normal : surface.shading_normal;
    const V3f geometric_normal = flip ? -surface.geometric_normal : surface.geometric_normal;
    const Frame frame(normal);
    const V3f wo = frame.to_local(wo_world);
    if (params.model == LobeModel::stack) {
      layers_ = evaluate_layers(scene_, hit, wo_world, footprint, surface, frame);
      params.layers = &layers_;
    }
    const bool lambert = params.model == LobeModel::lambert && !params.mapped;

    const bool black = material.one_sided && !surface.front;
    const bool ends = black || vertex >= task_.settings.max_segments || params.model == LobeModel::none;
    Late<Bsdf> bsdf;  // of all that is not Lambert
    if (!lambert && !(ends && vertex > 1)) bsdf.emplace(params, wo);
    if (vertex == 1) {
      const Rgb albedo = black ? Rgb(0, 0, 0) : lambert ? params.base_color : bsdf->albedo();
      const V3f seen = params.mapped ? frame.to_world(params.map_normal) : normal;
      b.first[i] = {albedo, seen, hit.t, hit.primitive};
    }
    recorder_.surface(i, surface, params, normal, geometric_normal, black);
    recorder_.scattering(bsdf.get());
    if (ends) return false;

    // Sample a light and weight it against the BSDF's finding it.
    const bool transmissive = !lambert && lets_light_through(params);
    const V3f light_normal = transmissive ? V3f(0, 0, 0) : surface.facing_normal();
    const V3f near_side = near_side_origin(surface, ray.direction);
    if (has_lights_ && !(lambert ? is_black(params.base_color) : bsdf->is_pure_delta())) {
      // Seen from where the rays will start: rounding may have put the position itself behind its own surface, which
      // would then, if it emits, light itself.
      const V3f from = transmissive ? surface.position : near_side;
      const LightSample light = lights_.sample(from, light_normal, b.select[j], V2f(b.light_x[j], b.light_y[j]));
      recorder_.light_sample(i, light);
      if (light.pdf_w > 0 && !is_black(light.radiance)) {
        const V3f wi = frame.to_local(light.direction);
        const BsdfValue value = lambert ? evaluate_lambert(params.base_color, wo, wi) : bsdf->evaluate(wi);
        recorder_.light_value(i, light, value);
        // A direction that the shading normal admits but the geometry does not would leak light.
        const bool consistent = dot(geometric_normal, light.direction) * wi.z > 0;
        if (consistent && !is_black(value.f_cos)) {
          const float weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
          Rgb radiance = path.beta * value.f_cos * light.radiance * (weight / light.pdf_w);
          const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
          if (scene_.features.absorption)
            radiance *=
                shadow_transmittance(scene_, path.media, *surface.part, surface.front, wi.z > 0, light.distance);
          const V3f origin = origin_towards(surface, near_side, light.direction);
          add_shadow_ray(vertex, i, origin, light.direction, t_max, radiance);
        }
      }
    }

    // Sample the BSDF for the next direction.
    const V2f u(b.bsdf_x[j], b.bsdf_y[j]);
    const BsdfSample sample = lambert ? sample_lambert(params.base_color, wo, square_to_cosine_hemisphere(u))
                                      : bsdf->sample(b.lobe[j], u);
    recorder_.scatter(i, sample, frame);
    if (!sample.valid()) return false;
    const V3f direction = frame.to_world(sample.wi);
    if (!(dot(geometric_normal, direction) * sample.wi.z > 0)) return false;
    path.beta *= sample.weight;
    path.pdf_w = sample.delta ? 0.0f : sample.pdf_w;
    path.normal = light_normal;
    if (scene_.mip_mapped && path.pdf_w > 0) b.cones[i].scatter(path.pdf_w);
    path.eta_scale *= sample.eta * sample.eta;
    if (sample.transmitted && material.volume)
      stats_.media_overflows += !path.media.cross(surface.part->material, wo.z > 0);
    recorder_.next_throughput(i, path.beta);
    if (is_black(path.beta)) return false;

    // Let the path die with a probability that its throughput gives.
    if (vertex >= task_.settings.roulette_from) {
      const float survival = survival_probability(task_.settings.roulette, path.beta * path.eta_scale);
      recorder_.roulette(i, survival, b.roulette[j]);
      if (!survives(b.roulette[j], survival)) return false;
      path.beta *= 1 / survival;
    }

    recorder_.goes_on(i);
    ray.origin = origin_towards(surface, near_side, direction);
    ray.direction = direction;
    ray.alpha_key = alpha_key(path.key, reversed_index_, vertex + 1);
    return true;
  }

  LayerParams layers_;  // of the vertex in hand
};

}  // namespace helio
