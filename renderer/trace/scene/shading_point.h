// A point of a surface as it is looked at: its material's parameters as the path kernels see them at a vertex.
#pragma once

#include "renderer/base/late.h"
#include "renderer/trace/bsdf/bsdf.h"
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
    wo_ = wo;
    bsdf_.emplace(params, frame.to_local(wo));
  }
  ShadingPoint(const ShadingPoint&) = delete;

  // Along the direction that it is looked at.
  const Bsdf& bsdf() const { return *bsdf_; }

  // On the side of the frame's normal that the surface's own is on.
  V3f geometric_normal() const { return viewed_normal(surface); }

  // f |cos wi| of unit world directions and the density of wi; black where the shading normal admits a direction that
  // the geometry does not, which would leak light. matte: if not null, gets Bsdf::matte() of it.
  BsdfValue evaluate(const V3f& wo, const V3f& wi, Rgb* matte = nullptr) const {
    const V3f local = frame.to_local(wi);
    if (matte) *matte = Rgb(0, 0, 0);
    if (black || !(dot(geometric_normal(), wi) * local.z > 0)) return {};
    Late<Bsdf> other;
    const Bsdf& seen = wo == wo_ ? *bsdf_ : other.emplace(params, frame.to_local(wo));
    const BsdfValue value = seen.evaluate(local);
    if (matte && !is_black(value.f_cos)) *matte = seen.matte(local);
    return value;
  }

 private:
  static float camera_footprint(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit) {
    RayCone cone = camera.cone();
    cone.advance(hit.t);
    return cone.footprint(dot(make_surface<true>(scene, ray, hit).geometric_normal, ray.direction));
  }

  V3f wo_;
  Late<Bsdf> bsdf_;
};

}  // namespace helio
