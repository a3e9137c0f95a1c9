#include "renderer/trace/scene/surface_prefetch.h"

#include "renderer/base/prefetch.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

void prefetch_corners(const SceneData& scene, const Hit& hit) {
  const TriangleMesh* mesh = scene.part(hit).mesh;
  if (mesh) prefetch(&mesh->indices[3 * std::size_t(hit.primitive)]);
}

void prefetch_attributes(const SceneData& scene, const Hit& hit) {
  const PartRecord& part = scene.part(hit);
  if (!part.mesh) return;
  const TriangleMesh& mesh = *part.mesh;
  const std::uint32_t* corners = &mesh.indices[3 * std::size_t(hit.primitive)];
  const MaterialRecord& material = scene.materials[part.material];
  const bool textured = material.textured || material.normal_mapped || material.scatters_mapped;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t corner = corners[k];
    if (part.smooth) prefetch(&mesh.normals[corner]);
    if (textured && !mesh.texcoords[0].empty()) prefetch(&mesh.texcoords[0][corner]);
    if (!mesh.colors.empty()) prefetch(&mesh.colors[corner]);
  }
}

void prefetch_texels(const SceneData& scene, const Hit& hit) {
  const PartRecord& part = scene.part(hit);
  const MaterialRecord& record = scene.materials[part.material];
  if (!part.mesh || !(record.textured || record.normal_mapped)) return;
  const Material& material = scene.description.materials[part.material];
  for (const TextureSlot* slot :
       {&material.base_color_texture, &material.normal_texture, &material.metallic_roughness_texture}) {
    if (!slot->present()) continue;
    scene.textures->prefetch(*slot, surface_uv(part, hit.primitive, V2f(hit.u, hit.v), slot->texcoord));
  }
}

}  // namespace helio
