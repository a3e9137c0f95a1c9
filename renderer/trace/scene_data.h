// Inside of a RenderScene: what the integrators read. Internal to trace/.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/scene/environment.h"
#include "renderer/scene/texture.h"
#include "renderer/trace/accel.h"
#include "renderer/trace/bsdf.h"
#include "renderer/trace/light_sampler.h"
#include "renderer/trace/render_scene.h"

namespace helio {

// A material with everything that does not depend on the hit worked out.
struct MaterialRecord {
  SurfaceParams params;     // complete when !textured, but for the pointer to the layers
  LayerParams layers;       // stack: complete when !layers_textured
  std::shared_ptr<const PlasticInterface> plastic;  // plastic
  Rgb emission{0, 0, 0};    // radiance factor
  Rgb absorption{0, 0, 0};  // per unit length inside the volume
  bool textured = false;    // some parameter needs a texture or a vertex colour
  bool layers_textured = false;
  bool numbers_textured = false;  // Material::numbers
  bool normal_mapped = false;     // by MapRule::bend
  bool scatters_mapped = false;   // by another one
  bool specular = false;  // has a lobe that mirrors, smooth or rough
  bool emissive = false;
  bool double_sided = false;
  bool one_sided = false;   // black from behind
  bool volume = false;      // keeps its outside and inside apart
  bool pure_delta = false;  // of the untextured parameters
  bool unlit = false;
};

// Shading data of one mesh or sphere.
struct PartRecord {
  const TriangleMesh* mesh = nullptr;  // null: sphere
  V3f center;
  float radius = 0;
  std::uint32_t material = 0;
  std::uint32_t first_emitter = kNoHit;  // flat parts: emitter index of primitive 0
  bool smooth = false;                   // has vertex normals
  float offset = 0;                      // how far off the surface the next ray starts, object units; see surface.h
  float through = 0;                     // the same where it passes through
};

struct InstanceRecord {
  std::uint32_t first_part = 0;               // into SceneData::object_parts
  std::uint32_t first_emitter_slot = kNoHit;  // into SceneData::instance_emitters, by part; kNoHit: emits nothing
  float to_world[12];                         // column-major 3x4
  float offset_scale = 1, offset = 0;  // world offset of a part: its own times the scale, plus that of the placement
  float normal_to_world[9];            // inverse transpose, column-major; oriented so that fronts stay fronts

  V3f direction(const V3f& v) const {
    return {to_world[0] * v.x + to_world[3] * v.y + to_world[6] * v.z,
            to_world[1] * v.x + to_world[4] * v.y + to_world[7] * v.z,
            to_world[2] * v.x + to_world[5] * v.y + to_world[8] * v.z};
  }
  V3f point(const V3f& p) const { return direction(p) + V3f(to_world[9], to_world[10], to_world[11]); }
  V3f normal(const V3f& n) const {
    return {normal_to_world[0] * n.x + normal_to_world[3] * n.y + normal_to_world[6] * n.z,
            normal_to_world[1] * n.x + normal_to_world[4] * n.y + normal_to_world[7] * n.z,
            normal_to_world[2] * n.x + normal_to_world[5] * n.y + normal_to_world[8] * n.z};
  }
};

struct RenderScene::Impl final : AlphaTest {
  SceneDescription description;
  SceneFeatures features;
  RenderSceneStats stats;
  V3d origin{0, 0, 0};
  Box3d world_bounds;
  float radius = 0;  // of a sphere around the rebased origin that holds everything

  std::optional<TextureTable> textures;
  bool mip_mapped = false;  // some texture has a pyramid: paths keep cones
  std::vector<MaterialRecord> materials;
  std::vector<PartRecord> flat;          // by top-level part id
  std::vector<PartRecord> object_parts;  // of instanced objects
  std::vector<InstanceRecord> instances;
  std::vector<std::uint32_t> instance_emitters;
  std::vector<std::uint32_t> flat_names, instance_names;  // description instance behind a flat part / an instance

  std::unique_ptr<LightSampler> lights;
  std::unique_ptr<Accel> accel;

  const PartRecord& part(const Hit& hit) const {
    return hit.instance == kNoHit ? flat[hit.part] : object_parts[instances[hit.instance].first_part + hit.part];
  }

  // Index of the area emitter that was hit, or kNoHit.
  std::uint32_t emitter(const Hit& hit, const PartRecord& part) const {
    if (hit.instance == kNoHit) {
      return part.first_emitter == kNoHit ? kNoHit : part.first_emitter + hit.primitive;
    }
    const std::uint32_t slot = instances[hit.instance].first_emitter_slot;
    if (slot == kNoHit) return kNoHit;
    const std::uint32_t first = instance_emitters[slot + hit.part];
    return first == kNoHit ? kNoHit : first + hit.primitive;
  }

  bool opaque_at(const AlphaHit& hit) const override;
};

using SceneData = RenderScene::Impl;

// Pre-evaluates a material. Pure function.
MaterialRecord make_material_record(const Material& material);

// Whether any hit on the material may let a ray pass. mesh: null for spheres.
bool has_alpha(const Material& material, const TriangleMesh* mesh, const TextureTable& textures);

}  // namespace helio
