// A vertex of a light path or a camera path: a point of a surface, and what it does with light between any two
// directions.
//
// Everything is told as the path tracer has it: `to_camera` is its wo, `to_light` its wi, and the shading normal is the
// one that it bends towards wo. So all bidirectional techniques estimate what the path tracer estimates, normals that
// depend on the view, maps that shadow one side and models that are not reciprocal included; a light path's throughput
// follows from it (adjoint_weight).
#pragma once

#include "renderer/trace/sampling/warp.h"
#include "renderer/trace/scene/media.h"
#include "renderer/trace/scene/shading_point.h"

namespace helio {

struct PathVertex {
  Hit hit;
  Surface surface;  // as the subpath reached it
  V3f arrived;      // unit, along the ray that did
  V3f near_side;    // near_side_origin()
  float footprint = 0;
  bool flat = false;     // one frame a side, whichever way it is looked at
  bool lambert = false;  // scatters as Lambert has it, by `albedo` and `unbent`: there is no more to know
  bool opaque = false;   // its material is known to send nothing to the side that it is not lit from
  Rgb albedo{0, 0, 0};
  V3f unbent;  // unbent_normal(), where not flat

  PathVertex() = default;
  // `cone`: of the path here, which chooses levels of mip-mapped textures; null: none.
  PathVertex(const SceneData& scene, const Ray& ray, const Hit& at, const RayCone* cone) {
    reach(scene, ray, at, cone);
    look_up(scene);
  }
  // In two steps: reach() sets what is above `lambert`, look_up() the rest.
  void reach(const SceneData& scene, const Ray& ray, const Hit& at, const RayCone* cone);
  void look_up(const SceneData& scene);

  float cosine(const V3f& direction) const { return std::fabs(dot(surface.geometric_normal, direction)); }
  // Where a ray along the direction starts.
  V3f start(const V3f& direction) const { return origin_towards(surface, near_side, direction); }

  // Made for `wo`: known to be what a point made for `to_camera` would be.
  bool serves(const SceneData& scene, const ShadingPoint& point, const V3f& wo, const V3f& to_camera) const;

  // Whether a delta that maps `made_for`, which `point` was made for, to `other` maps `other` back when the vertex is
  // looked at from there: not where the shading normal was bent towards one of the two.
  bool mirrors_back(const ShadingPoint& point, const V3f& made_for, const V3f& other) const;

  // The normal of a Lambert vertex's frame where it is reached: that of shading_frame().
  V3f lambert_normal() const {
    return flat ? surface.facing_normal() : shading_normal(-arrived) * (surface.front ? 1.0f : -1.0f);
  }

  // Whether scatter() may be anything but black, as far as little work tells: for directions of any length but 0.
  bool may_scatter(const V3f& to_camera, const V3f& to_light) const {
    if (!opaque) return true;
    const float seen = dot(surface.geometric_normal, to_camera), lit = dot(surface.geometric_normal, to_light);
    if (seen == 0) return !(flat && lambert) && lit > 0;
    return seen > 0 ? lit > 0 : lit < 0;
  }

  // Whether a point that was made once is of use: not to a Lambert vertex, nor to a blend, whose parts are overwritten.
  bool keeps_its_point() const { return !lambert && surface.material->params.model != LobeModel::blend; }

  // The point for scatter() that looks along the unit direction.
  const ShadingPoint& look_from(const SceneData& scene, const V3f& direction, Late<ShadingPoint>& point) const {
    return point.emplace(scene, hit, seen_from(direction), direction, footprint, flat ? nullptr : &unbent);
  }

  // f |cos to_light|, and the density with which the path tracer, coming from `to_camera`, samples `to_light`; deltas
  // excluded. `point`, made for `wo`, saves the making of another where it serves; null: none. matte: if not null, gets
  // Bsdf::matte() of it; of a Lambert vertex nobody asks.
  BsdfValue scatter(const SceneData& scene, const V3f& to_camera, const V3f& to_light, const ShadingPoint* point,
                    const V3f& wo, Rgb* matte = nullptr) const {
    if (!lambert) return scatter_any(scene, to_camera, to_light, point, wo, matte);
    return flat ? scatter_flat(to_camera, to_light) : scatter_smooth(to_camera, to_light);
  }
  // That of (wo, other) and of (other, wo). `point`: made for `wo`, or null.
  BsdfBothWays scatter_both_ways(const SceneData& scene, const V3f& wo, const V3f& other,
                                 const ShadingPoint* point) const {
    if (!lambert) return scatter_both_ways_any(scene, wo, other, point);
    if (flat) return {scatter_flat(wo, other), scatter_flat(other, wo)};
    return {scatter_smooth(wo, other), scatter_smooth(other, wo)};
  }

  // As the unit direction sees it. Precondition: has_shading_normals().
  V3f shading_normal(const V3f& direction) const {
    return bent_normal(unbent, surface, direction, dot(surface.geometric_normal, direction) >= 0);
  }

 private:
  BsdfValue scatter_flat(const V3f& to_camera, const V3f& to_light) const {
    const float seen = dot(surface.geometric_normal, to_camera), lit = dot(surface.geometric_normal, to_light);
    if (!(seen * lit > 0) || (seen < 0 && surface.material->one_sided)) return {};
    const float pdf_w = cosine_hemisphere_pdf_w(std::fabs(lit));
    return {albedo * pdf_w, pdf_w};
  }
  // As ShadingPoint::evaluate() has it.
  BsdfValue scatter_smooth(const V3f& to_camera, const V3f& to_light) const {
    const float seen = dot(surface.geometric_normal, to_camera), lit = dot(surface.geometric_normal, to_light);
    const float side = seen >= 0 ? 1.0f : -1.0f;
    if (!(side * lit > 0) || (seen < 0 && surface.material->one_sided)) return {};
    const V3f normal = shading_normal(to_camera);
    if (!(side * dot(normal, to_camera) > 0)) return {};
    const float pdf_w = cosine_hemisphere_pdf_w(side * dot(normal, to_light));
    return {albedo * pdf_w, pdf_w};
  }
  BsdfBothWays scatter_both_ways_any(const SceneData& scene, const V3f& wo, const V3f& other,
                                     const ShadingPoint* point) const;
  BsdfValue scatter_any(const SceneData& scene, const V3f& to_camera, const V3f& to_light, const ShadingPoint* point,
                        const V3f& wo, Rgb* matte) const;
  // The surface as it is looked at along a direction, without its shading normal.
  Surface seen_from(const V3f& direction) const;
};

// What light from `to_light` leaves along `to_camera` for a light path's throughput, before it is divided by the
// density of what comes next: f_cos of the above times |cos_g(to_camera)| / |cos_g(to_light)|. The cosine to the light
// is that of the shading normal, the area density with which a light path arrives has the geometric one: Veach 1997,
// eq. 5.19. 0 where light arrives along the surface.
inline Rgb adjoint_weight(const PathVertex& vertex, const Rgb& f_cos, const V3f& to_camera, const V3f& to_light) {
  const float arriving = vertex.cosine(to_light);
  return arriving > 0 ? f_cos * (vertex.cosine(to_camera) / arriving) : Rgb(0, 0, 0);
}

}  // namespace helio
