// The path tracer's kernel for everything: light samples weighted against what its directions find.
#pragma once

#include "renderer/trace/integrators/camera_path_kernel.h"

namespace helio {

template <typename Recorder>
class GeneralKernel : public CameraPathKernel<GeneralKernel<Recorder>, Recorder> {
  using Base = CameraPathKernel<GeneralKernel<Recorder>, Recorder>;

 public:
  using Base::Base;

 private:
  friend Base;
  friend PathKernelBase<GeneralKernel, Recorder>;
  using Base::add_shadow_ray, Base::group_, Base::recorder_, Base::scene_;

  void prepare_paths(int count) { Base::start_cones(count); }

  void light(int vertex, const CameraVertex& v, const LightSample& light) {
    const std::uint32_t i = v.path;
    const PathState& path = group_.paths[i];
    const Surface& surface = v.at.surface;
    recorder_.light_sample(i, light);
    if (!(light.pdf_w > 0) || is_black(light.radiance)) return;
    const V3f wi = v.frame.to_local(light.direction);
    const BsdfValue value = v.evaluate(wi);
    recorder_.light_value(i, light, value);
    // A direction that the shading normal admits but the geometry does not would leak light.
    const bool consistent = dot(v.geometric_normal, light.direction) * wi.z > 0;
    if (!consistent || is_black(value.f_cos)) return;
    const float weight = light.delta ? 1.0f : mis_weight(light.pdf_w, value.pdf_w);
    Rgb radiance = path.beta * value.f_cos * light.radiance * (weight / light.pdf_w);
    const float t_max = shadow_length(light.distance, light.cos_light, surface.offset, scene_.radius);
    if (scene_.features.absorption)
      radiance *= shadow_transmittance(scene_, path.media, *surface.part, surface.front, wi.z > 0, light.distance);
    add_shadow_ray(vertex, i, v.at.start(light.direction), light.direction, t_max, radiance);
  }
};

}  // namespace helio
