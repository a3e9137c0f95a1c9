// Whether a hit on a surface with alpha exists for a ray: SceneData::opaque_at() and surface_alpha().
#ifndef ALPHA_GLSL
#define ALPHA_GLSL

#include "scene/geometry.glsl"

#include "lights/environment.glsl"
#include "sampling/sampler.glsl"
#include "scene/textures.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer AlphaMaterials {
  MaterialTable at[];
};

// Alpha at a hit. `normal` is that of a Hit: where spheres take their texture coordinates from.
float surface_alpha(uint index, uint primitive, vec2 barycentric, vec3 normal) {
  Parts parts = Parts(scene.geometry.parts);
  AlphaMaterials materials = AlphaMaterials(scene.materials);
  const uint material = parts.at[index].material;
  const bool sphere = (parts.at[index].flags & kPartSphere) != 0;
  float alpha = materials.at[material].base_alpha;
  const TextureSlotTable slot = materials.at[material].alpha_texture;
  if (slot.image != kNone) {
    const vec2 uv = sphere ? environment_uv(normal) : texcoord_at(index, primitive, barycentric, slot.texcoord);
    alpha *= texture_lookup(slot, uv).w;
  }
  const uint64_t colors = parts.at[index].colors;
  if (!sphere && colors != 0) {
    const uvec3 i = corner_indices(parts.at[index].indices, primitive);
    Vec4s values = Vec4s(colors);
    alpha *= values.at[i.x].w * (1 - barycentric.x - barycentric.y) + values.at[i.y].w * barycentric.x +
             values.at[i.z].w * barycentric.y;
  }
  return alpha;
}

// Whether the hit stops the ray. `front`: the ray arrives against the normal. Every surface on the way decides by its
// own random number, the same whenever the same ray meets it; the near and the far side of a sphere are two surfaces.
bool opaque_at(uint part, uint instance, uint primitive, vec2 barycentric, vec3 normal, bool front, uint alpha_key) {
  const uint index = part_index(part, instance);
  const float alpha = surface_alpha(index, primitive, barycentric, normal);
  Parts parts = Parts(scene.geometry.parts);
  AlphaMaterials materials = AlphaMaterials(scene.materials);
  const uint material = parts.at[index].material;
  if (materials.at[material].alpha_mode == kAlphaMask) return alpha >= materials.at[material].alpha_cutoff;
  const bool sphere = (parts.at[index].flags & kPartSphere) != 0;
  const uint surface = sphere ? uint(!front) : primitive;
  const uint bits = combine_hash(combine_hash(alpha_key, surface), combine_hash(part, instance));
  return unit_float(bits) < alpha;
}

#endif
