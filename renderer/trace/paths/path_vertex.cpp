#include "renderer/trace/paths/path_vertex.h"

namespace helio {

namespace {

// True where lets_light_through() is false whatever the textures say.
bool never_lets_light_through(const MaterialRecord& material) {
  const LobeModel model = material.params.model;
  if (material.params.transmission > 0 || material.numbers_textured || model == LobeModel::blend) return false;
  return model != LobeModel::stack || !(material.layers.diffuse_transmission > 0);
}

}  // namespace

void PathVertex::reach(const SceneData& scene, const Ray& ray, const Hit& at, const RayCone* cone) {
  hit = at;
  surface = make_surface<true>(scene, ray, at);
  arrived = ray.direction;
  footprint = cone ? cone->footprint(dot(surface.geometric_normal, arrived)) : 0;
  near_side = near_side_origin(surface, arrived);
  flat = !has_shading_normals(surface) && !surface.material->scatters_mapped;
}

void PathVertex::look_up(const SceneData& scene) {
  if (!flat) unbent = unbent_normal(scene, hit, footprint, surface);
  opaque = never_lets_light_through(*surface.material);
  lambert = surface.material->plain_lambert;
  if (lambert) albedo = evaluate_base_color(scene, hit, footprint, surface);
}

Surface PathVertex::seen_from(const V3f& direction) const {
  Surface seen = surface;
  seen.front = dot(surface.geometric_normal, direction) >= 0;
  seen.shading_normal = surface.geometric_normal;
  return seen;
}

bool PathVertex::mirrors_back(const ShadingPoint& point, const V3f& made_for, const V3f& other) const {
  if (flat || other == made_for) return true;
  if (surface.material->scatters_mapped) return false;
  return shading_normal(other) == point.surface.shading_normal;
}

bool PathVertex::serves(const SceneData& scene, const ShadingPoint& point, const V3f& wo, const V3f& to_camera) const {
  if (point.params.model == LobeModel::blend) return false;  // its parts may have been overwritten since
  if (wo == to_camera) return true;
  if (point.params.model == LobeModel::stack && point.layers.clearcoat > 0) {  // a normal of its own is bent, too
    const MaterialLayers& layers = scene.description.materials[surface.part->material].layers;
    if (surface.material->normal_mapped || layers.clearcoat_normal_texture.present()) return false;
  }
  const bool front = dot(surface.geometric_normal, to_camera) >= 0;
  return front == point.surface.front && mirrors_back(point, wo, to_camera);
}

BsdfValue PathVertex::scatter_any(const SceneData& scene, const V3f& to_camera, const V3f& to_light,
                                  const ShadingPoint* point, const V3f& wo, Rgb* matte) const {
  Late<ShadingPoint> made;
  if (!point || !serves(scene, *point, wo, to_camera)) point = &look_from(scene, to_camera, made);
  return point->evaluate(to_camera, to_light, matte);
}

BsdfBothWays PathVertex::scatter_both_ways_any(const SceneData& scene, const V3f& wo, const V3f& other,
                                               const ShadingPoint* point) const {
  if (point && serves(scene, *point, wo, other)) return point->evaluate_both_ways(other);
  return {scatter_any(scene, wo, other, point, wo, nullptr), scatter_any(scene, other, wo, point, wo, nullptr)};
}

}  // namespace helio
