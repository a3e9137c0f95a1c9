// Inside of a RenderScene: what the integrators read. Internal to trace/.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"
#include "renderer/trace/accel/accel.h"
#include "renderer/trace/bsdf/surface_params.h"
#include "renderer/trace/lights/light_sampler.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// A material with everything that does not depend on the hit worked out.
struct MaterialRecord {
  SurfaceParams params;                             // complete when !textured, but for the pointer to the layers
  LayerParams layers;                               // stack: complete when !layers_textured
  std::shared_ptr<const PlasticInterface> plastic;  // plastic
  Rgb emission{0, 0, 0};                            // radiance factor
  Rgb absorption{0, 0, 0};                          // per unit length inside the volume
  bool textured = false;                            // some parameter needs a texture or a vertex colour
  bool layers_textured = false;
  bool numbers_textured = false;  // Material::numbers
  bool normal_mapped = false;     // by MapRule::bend
  bool scatters_mapped = false;   // by another one
  bool specular = false;          // has a lobe that mirrors, smooth or rough
  bool plain_lambert = false;     // Lambert in the surface's frame: evaluate_base_color() is all there is to look up
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
  std::uint32_t first_part = 0;  // into SceneData::object_parts
  std::uint32_t part_count = 0;
  std::uint32_t accel_object = 0;             // AccelInstance::object
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

// What no edit changes: a scene and all that are made from it by edits share it.
struct SceneAssets {
  std::vector<Object> objects;  // baked ones in rebased world space, but for their spheres
  std::vector<Box3d> boxes;     // of the objects, in their own space as loaded
  std::vector<bool> baked;      // by object
  std::vector<MaterialUse> material_uses;
  std::vector<Image> images;
  std::optional<TextureTable> textures;
  std::uint64_t bytes = 0;
};

// What samples an environment map.
struct EnvironmentTable {
  std::shared_ptr<const EnvironmentDistribution> distribution;  // null: none
  Rgb radiance{0, 0, 0};                                        // Environment::radiance that it was made for
  int image = -1;
};

// An object that was baked and has been moved since: an instance whose own space is the rebased world as loaded.
struct TakenOut {
  std::uint32_t name = 0;        // description instance
  M44d baked_to_world;           // its transform when it was baked
  std::uint32_t first_part = 0;  // into SceneData::object_parts
  std::uint32_t part_count = 0;
  std::uint32_t accel_object = 0;
};

struct RenderScene::Impl final : AlphaTest {
  SceneDescription description;  // without its objects and images, which are in `assets`
  SceneFeatures features;
  RenderSceneStats stats;
  V3d origin{0, 0, 0};
  Box3d world_bounds;
  float radius = 0;  // of a sphere around the rebased origin that holds everything

  std::shared_ptr<const SceneAssets> assets;
  const TextureTable* textures = nullptr;  // of `assets`
  bool mip_mapped = false;                 // some texture has a pyramid: paths keep cones
  std::vector<MaterialRecord> materials;
  std::vector<PartRecord> flat;          // by top-level part id
  std::vector<PartRecord> object_parts;  // of instanced objects
  std::vector<InstanceRecord> instances;
  std::vector<std::uint32_t> instance_emitters;
  std::vector<std::uint32_t> flat_names, instance_names;  // description instance behind a flat part / an instance

  std::vector<TakenOut> taken_out;  // by name; their instances are the last, in this order
  std::uint64_t table_bytes = 0;    // light tables, records and lists that no other scene shares
  EnvironmentTable environment_table;

  std::shared_ptr<LightSampler> lights;
  std::unique_ptr<Accel> accel;
  std::optional<EditSummary> edit;

  // Of a flat part: its object stands elsewhere, as an instance.
  bool is_taken_out(std::size_t part) const {
    return std::any_of(taken_out.begin(), taken_out.end(),
                       [&](const TakenOut& object) { return object.name == flat_names[part]; });
  }

  const PartRecord& part(const Hit& hit) const {
    return hit.instance == kNoHit ? flat[hit.part] : object_parts[instances[hit.instance].first_part + hit.part];
  }

  // Index of the instance that was hit in the scene's description.
  std::uint32_t instance_name(const Hit& hit) const {
    return hit.instance != kNoHit ? instance_names[hit.instance] : flat_names[hit.part];
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

// Materials' tables, now and not on the first sample that needs them.
void prepare_material_tables(const Material& material, const SceneFeatures& features);

// A part as it is handed to the Accel and as its hits are shaded, in the space that its coordinates are in. The mesh
// must be padded (pad()) and outlive both.
AccelPart accel_part(const TriangleMesh& mesh, const Material& material, const TextureTable& textures);
AccelPart accel_part(const V3f& center, float radius, const Material& material, const TextureTable& textures);
AccelInstance accel_instance(const InstanceRecord& record);
PartRecord part_record(const TriangleMesh& mesh);
PartRecord part_record(const V3f& center, float radius, std::uint32_t material);

// How far rays start off the surfaces of flat parts, anew: past what widened neighbours stand out by, where
// `edge_dilation_radius` (AccelInput) is not 0.
void set_flat_offsets(SceneData& data, float edge_dilation_radius);
// What instances in such a scene add to their offsets for the same reason.
float edge_dilation_offset(float edge_dilation_radius);

// Fills in the figures of data that tell of memory, but for stats.own_bytes.
void count_memory(SceneData& data);

// Whether any hit on the material may let a ray pass. mesh: null for spheres.
bool has_alpha(const Material& material, const TriangleMesh* mesh, const TextureTable& textures);

}  // namespace helio
