#include "renderer/trace/scene/surface_prefetch.h"

#include "renderer/base/prefetch.h"
#include "renderer/trace/scene/surface.h"

namespace helio {
namespace {

bool looks_up(const MaterialRecord& material) {
  return material.textured || material.normal_mapped || material.scatters_mapped;
}

// f(slot) for those textures of a part's material that are asked for.
template <class F>
void for_each_slot(const SceneData& scene, const PartRecord& part, const F& f) {
  if (!looks_up(scene.materials[part.material])) return;
  const Material& material = scene.description.materials[part.material];
  for (const TextureSlot* slot :
       {&material.base_color_texture, &material.normal_texture, &material.metallic_roughness_texture}) {
    if (slot->present()) f(*slot);
  }
}

}  // namespace

void prefetch_corners(const SceneData& scene, const Hit& hit) {
  const PartRecord& part = scene.part(hit);
  if (!part.mesh) return;
  if (part.smooth || !part.mesh->colors.empty() || looks_up(scene.materials[part.material]))
    prefetch(&part.mesh->indices[3 * std::size_t(hit.primitive)]);
}

void prefetch_attributes(const SceneData& scene, const Hit& hit) {
  const PartRecord& part = scene.part(hit);
  if (!part.mesh) return;
  const TriangleMesh& mesh = *part.mesh;
  const std::uint32_t* const corners = &mesh.indices[3 * std::size_t(hit.primitive)];
  const auto prefetch_corners_of = [&](const auto& values) {
    for (int k = 0; !values.empty() && k < 3; ++k) prefetch(&values[corners[k]]);
  };
  if (part.smooth) prefetch_corners_of(mesh.normals);
  if (!mesh.colors.empty()) prefetch_corners_of(mesh.colors);
  int last_set = -1;
  for_each_slot(scene, part, [&](const TextureSlot& slot) {
    if (slot.texcoord == last_set || slot.texcoord < 0 || slot.texcoord >= kMaxTexcoordSets) return;
    last_set = slot.texcoord;
    prefetch_corners_of(mesh.texcoords[std::size_t(last_set)]);
  });
}

void prefetch_texels(const SceneData& scene, const Hit& hit) {
  const PartRecord& part = scene.part(hit);
  if (!part.mesh) return;
  for_each_slot(scene, part, [&](const TextureSlot& slot) {
    scene.textures->prefetch(slot, surface_uv(part, hit.primitive, V2f(hit.u, hit.v), slot.texcoord));
  });
}

void prefetch_hits(const SceneData& scene, const Hit* hits, const std::uint32_t* order, int count) {
  const auto for_each_hit = [&](auto prefetch) {
    for (int j = 0; j < count; ++j) {
      const Hit& hit = hits[order[j]];
      if (hit.valid()) prefetch(scene, hit);
    }
  };
  for_each_hit(prefetch_corners);
  for_each_hit(prefetch_attributes);
  if (!scene.mip_mapped && (scene.features.textures || scene.features.normal_maps)) for_each_hit(prefetch_texels);
}

}  // namespace helio
