#include "renderer/trace/paths/path_vertex.h"

namespace helio {

void PathVertex::reach(const SceneData& scene, const Ray& ray, const Hit& at, const RayCone* cone) {
  hit = at;
  surface = make_surface<true>(scene, ray, at);
  arrived = ray.direction;
  footprint = cone ? cone->footprint(dot(surface.geometric_normal, arrived)) : 0;
  near_side = near_side_origin(surface, arrived);
  const MaterialRecord& material = *surface.material;
  flat = !surface.part->smooth && !material.normal_mapped && !material.scatters_mapped;
}

void PathVertex::look_up(const SceneData& scene) {
  lambert = flat && surface.material->plain_lambert;
  if (lambert) albedo = evaluate_base_color(scene, hit, footprint, surface);
}

Surface PathVertex::seen_from(const V3f& direction) const {
  Surface seen = surface;
  seen.front = dot(surface.geometric_normal, direction) >= 0;
  seen.shading_normal = surface.geometric_normal;
  return seen;
}

bool PathVertex::mirrors_back(const SceneData& scene, const ShadingPoint& point, const V3f& made_for,
                              const V3f& other) const {
  if (flat || other == made_for) return true;
  if (surface.material->scatters_mapped) return false;
  Surface seen = seen_from(other);
  interpolate_normal(scene, hit, other, footprint, seen);
  return seen.shading_normal == point.surface.shading_normal;
}

bool PathVertex::serves(const SceneData& scene, const ShadingPoint& point, const V3f& wo, const V3f& to_camera) const {
  if (point.params.model == LobeModel::blend) return false;  // its parts may have been overwritten since
  if (wo == to_camera) return true;
  const bool front = dot(surface.geometric_normal, to_camera) >= 0;
  return front == point.surface.front && mirrors_back(scene, point, wo, to_camera);
}

BsdfValue PathVertex::scatter_any(const SceneData& scene, const V3f& to_camera, const V3f& to_light,
                                  const ShadingPoint* point, const V3f& wo, Rgb* matte) const {
  Late<ShadingPoint> made;
  if (!point || !serves(scene, *point, wo, to_camera))
    point = &made.emplace(scene, hit, seen_from(to_camera), to_camera, footprint);
  return point->evaluate(to_camera, to_light, matte);
}

}  // namespace helio
