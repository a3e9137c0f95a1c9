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
  // `footprint`: see evaluate_material(). `unbent`: unbent_normal() of it where that is known; null: not.
  ShadingPoint(const SceneData& scene, const Hit& hit, const Surface& at, const V3f& wo, float footprint,
               const V3f* unbent = nullptr)
      : surface(at) {
    const MaterialRecord& material = *surface.material;
    surface.shading_normal = surface.geometric_normal;
    if (has_shading_normals(surface)) {
      surface.shading_normal =
          bent_normal(unbent ? *unbent : unbent_normal(scene, hit, footprint, surface), surface, wo, surface.front);
    }
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
    if (black || !agrees(wi, local)) return {};
    if (wi == wo_ && !matte) return bsdf_->evaluate_back(params, local, frame.to_local(wo));
    Late<Bsdf> other;
    const Bsdf& seen = wo == wo_ ? *bsdf_ : other.emplace(params, frame.to_local(wo));
    const BsdfValue value = seen.evaluate(local);
    if (matte && !is_black(value.f_cos)) *matte = seen.matte(local);
    return value;
  }

  // That of (the direction that it is looked at along, `other`) and of (`other`, that direction). Precondition: a point
  // looked at along `other` has the same frame.
  BsdfBothWays evaluate_both_ways(const V3f& other) const {
    if (black) return {};
    const V3f local = frame.to_local(other), own = frame.to_local(wo_);
    const bool there = agrees(other, local), back = agrees(wo_, own);
    if (!there && !back) return {};
    const BsdfBothWays both = bsdf_->evaluate_both_ways(params, own, local);
    return {there ? both.there : BsdfValue(), back ? both.back : BsdfValue()};
  }

 private:
  // The frame and the geometry have the direction on the same side.
  bool agrees(const V3f& direction, const V3f& local) const {
    return dot(geometric_normal(), direction) * local.z > 0;
  }
  static float camera_footprint(const SceneData& scene, const Camera& camera, const Ray& ray, const Hit& hit) {
    RayCone cone = camera.cone();
    cone.advance(hit.t);
    return cone.footprint(dot(make_surface<true>(scene, ray, hit).geometric_normal, ray.direction));
  }

  V3f wo_;
  Late<Bsdf> bsdf_;
};

}  // namespace helio
