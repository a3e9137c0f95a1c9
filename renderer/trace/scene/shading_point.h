// A point of a surface as it is looked at: its material's parameters as the path kernels see them at a vertex.
#pragma once

#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/surface.h"
#include "renderer/trace/scene/surface_layers.h"

namespace helio {

// `params` may point to `layers`, and of a blend to parts that the next look at a surface in this thread overwrites.
struct ShadingPoint {
  Surface surface;
  SurfaceParams params;
  LayerParams layers;
  Frame frame;
  bool black = false;  // one-sided, seen from behind

  // Where a camera ray meets it.
  ShadingPoint(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit)
      : ShadingPoint(scene, hit, make_surface<true>(scene, ray, hit), -ray.direction,
                     scene.mip_mapped ? camera_footprint(scene, camera, ray, hit) : 0.0f) {}

  // Looked at along the unit `wo`, which lies on the side that `at.front` says; its shading normal is set here.
  // `footprint`: see evaluate_material().
  ShadingPoint(const SceneData& scene, const Hit& hit, const Surface& at, const V3f& wo, float footprint)
      : surface(at) {
    const MaterialRecord& material = *surface.material;
    surface.shading_normal = surface.geometric_normal;
    if (surface.part->smooth || material.normal_mapped) interpolate_normal(scene, hit, wo, footprint, surface);
    params = evaluate_material(scene, hit, wo, footprint, surface);
    frame = shading_frame(surface);
    if (params.model == LobeModel::stack) {
      layers = evaluate_layers(scene, hit, wo, footprint, surface, frame);
      params.layers = &layers;
    }
    black = material.one_sided && !surface.front;
  }
  ShadingPoint(const ShadingPoint&) = delete;

  // On the side of the frame's normal that the surface's own is on.
  V3f geometric_normal() const {
    return !surface.front && !surface.material->volume ? -surface.geometric_normal : surface.geometric_normal;
  }

  // f |cos wi| of unit world directions and the density of wi; black where the shading normal admits a direction that
  // the geometry does not, which would leak light.
  BsdfValue evaluate(const V3f& wo, const V3f& wi) const {
    const V3f local = frame.to_local(wi);
    if (black || !(dot(geometric_normal(), wi) * local.z > 0)) return {};
    return evaluate_bsdf(params, frame.to_local(wo), local);
  }

  // matte_cos() of that, where it is not black.
  Rgb matte(const V3f& wo, const V3f& wi) const { return matte_cos(params, frame.to_local(wo), frame.to_local(wi)); }

 private:
  static float camera_footprint(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit) {
    RayCone cone = camera.cone();
    cone.advance(hit.t);
    return cone.footprint(dot(make_surface<true>(scene, ray, hit).geometric_normal, ray.direction));
  }
};

}  // namespace helio
