// What a scene needs, reduced to bits: kernels are specialised on them and passes that cannot matter are not run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace helio {

struct SceneDescription;

// From this many lights on (SceneFeatures::light_count) a light tree selects, else power: two do not gain by a tree. A
// quad of two triangles is one light.
inline constexpr std::uint32_t kLightTreeThreshold = 3;

struct SceneFeatures {
  // surface response
  bool only_lambert = false;        // every material is Lambert (plus emission): no microfacet code is needed
  bool delta_lobes = false;         // some lobe is a delta: alpha below the delta switch, smooth dielectric
  bool rough_transmission = false;
  bool microfacet = false;
  bool absorption = false;          // some volume absorbs
  bool layers = false;              // clearcoat, sheen, anisotropy, iridescence or diffuse transmission
  bool textures = false;            // any texture lookup while shading
  bool normal_maps = false;
  bool vertex_colors = false;
  bool alpha = false;               // some surface is masked or blended: rays may pass through hits
  // geometry
  bool instances = false;           // a bottom-level BVH is used more than once
  bool spheres = false;
  bool smooth_normals = false;
  bool fast_rays = false;           // measured on the built scene: watertight without Embree's robust mode
  // lights
  bool area_lights = false;
  bool textured_emission = false;
  bool delta_lights = false;        // point, spot, directional
  bool environment = false;
  std::uint32_t light_count = 0;    // emissive triangles and spheres, punctual lights, environment
  bool light_tree = false;          // many lights: select by tree; else by power
  bool caustics = false;            // a delta or low-roughness lobe can focus light

  // Names of the bits that are set, in declaration order, for reports.
  std::vector<std::string> names() const;
  bool operator==(const SceneFeatures&) const = default;
};

// How a scene uses one of its materials.
struct MaterialUse {
  bool used = false;             // by a surface, or by a blend that is
  std::uint64_t primitives = 0;  // triangles and spheres that have it, instances counted
};
// By material.
std::vector<MaterialUse> find_material_uses(const SceneDescription& scene);

// Works the bits that depend on materials and lights out anew, for a scene of which only these have changed. Those of
// geometry, fast_rays and alpha stay as they are.
void update_features(const SceneDescription& scene, const std::vector<MaterialUse>& uses, SceneFeatures& features);

// Pure function of the description, so without fast_rays (light_count counts emissive triangles of all instances).
SceneFeatures find_scene_features(const SceneDescription& scene);

}  // namespace helio
