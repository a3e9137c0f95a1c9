#include "renderer/trace/scene/surface.h"

#include "renderer/scene/description/material_slots.h"
#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/lights/light_emission.h"
#include "renderer/trace/scene/surface_blend.h"
#include "renderer/trace/scene/surface_bump.h"
#include "renderer/trace/scene/surface_layers.h"
#include "renderer/trace/scene/surface_map.h"
#include "renderer/trace/scene/surface_numbers.h"

namespace helio {
namespace {

template <class T>
T interpolate(const std::vector<T>& values, const TriangleMesh& mesh, std::uint32_t primitive, const V2f& b) {
  const std::uint32_t* i = &mesh.indices[3 * std::size_t(primitive)];
  return values[i[0]] * (1 - b.x - b.y) + values[i[1]] * b.x + values[i[2]] * b.y;
}

bool normalizable(const V3f& v) {
  const float l2 = length_squared(v);
  return l2 > 1e-30f && l2 < 1e30f;
}

// Tangent and bitangent in world space; false when the texture coordinates do not span the surface.
bool tangent_frame(const SceneData& scene, const Hit& hit, const PartRecord& part, int uv_set, const V3f& normal,
                   V3f& tangent, V3f& bitangent) {
  const TriangleMesh& mesh = *part.mesh;
  const InstanceRecord* instance = hit.instance == kNoHit ? nullptr : &scene.instances[hit.instance];
  const auto world = [&](const V3f& v) { return instance ? instance->direction(v) : v; };
  if (!mesh.tangents.empty()) {
    const V4f t = interpolate(mesh.tangents, mesh, hit.primitive, V2f(hit.u, hit.v));
    tangent = world(V3f(t.x, t.y, t.z));
    tangent = tangent - normal * dot(tangent, normal);
    if (!normalizable(tangent)) return false;
    tangent = normalize(tangent);
    bitangent = cross(normal, tangent) * (t.w < 0 ? -1.0f : 1.0f);
    return true;
  }
  const auto& uvs = mesh.texcoords[std::size_t(uv_set)];
  if (uvs.empty()) return false;
  const std::uint32_t* i = &mesh.indices[3 * std::size_t(hit.primitive)];
  const V2f d1 = uvs[i[1]] - uvs[i[0]], d2 = uvs[i[2]] - uvs[i[0]];
  const V3f e1 = world(mesh.positions[i[1]] - mesh.positions[i[0]]);
  const V3f e2 = world(mesh.positions[i[2]] - mesh.positions[i[0]]);
  const float determinant = d1.x * d2.y - d1.y * d2.x;
  if (!(std::fabs(determinant) > 1e-20f)) return false;
  // The v axis of glTF's texture coordinates points down the image while its bitangent points up.
  tangent = (e1 * d2.y - e2 * d1.y) * (1 / determinant);
  V3f down = (e2 * d1.x - e1 * d2.x) * (1 / determinant);
  tangent = tangent - normal * dot(tangent, normal);
  if (!normalizable(tangent) || !normalizable(down)) return false;
  tangent = normalize(tangent);
  bitangent = cross(normal, tangent);
  if (dot(bitangent, down) > 0) bitangent = -bitangent;
  return true;
}

}  // namespace

V2f surface_uv(const PartRecord& part, std::uint32_t primitive, const V2f& barycentric, int set) {
  if (!part.mesh || set < 0 || set >= kMaxTexcoordSets) return V2f(0, 0);
  const auto& uvs = part.mesh->texcoords[std::size_t(set)];
  if (uvs.empty()) return V2f(0, 0);
  return interpolate(uvs, *part.mesh, primitive, barycentric);
}

V2f surface_uv_at(const Hit& hit, const Surface& surface, int set) {
  if (!surface.part->mesh) return sphere_uv(hit.instance == kNoHit ? surface.geometric_normal : hit.normal);
  return surface_uv(*surface.part, hit.primitive, surface.barycentric, set);
}

float uv_per_length(const SceneData& scene, const Hit& hit, const Surface& surface, int set) {
  if (!surface.part->mesh || set < 0 || set >= kMaxTexcoordSets) return 0;
  const TriangleMesh& mesh = *surface.part->mesh;
  const auto& uvs = mesh.texcoords[std::size_t(set)];
  if (uvs.empty()) return 0;
  const std::uint32_t* i = &mesh.indices[3 * std::size_t(hit.primitive)];
  const V2f d1 = uvs[i[1]] - uvs[i[0]], d2 = uvs[i[2]] - uvs[i[0]];
  V3f e1 = mesh.positions[i[1]] - mesh.positions[i[0]], e2 = mesh.positions[i[2]] - mesh.positions[i[0]];
  if (hit.instance != kNoHit) {
    e1 = scene.instances[hit.instance].direction(e1);
    e2 = scene.instances[hit.instance].direction(e2);
  }
  const float area = length(cross(e1, e2));
  return area > 0 ? std::sqrt(std::fabs(d1.x * d2.y - d1.y * d2.x) / area) : 0.0f;
}

namespace {

V4f lookup_at(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& slot,
              float footprint) {
  const V2f uv = surface_uv_at(hit, surface, slot.texcoord);
  if (!(footprint > 0)) return scene.textures->lookup(slot, uv);
  return scene.textures->lookup(slot, uv, footprint * uv_per_length(scene, hit, surface, slot.texcoord));
}

}  // namespace

V4f surface_texel(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& slot,
                  float footprint) {
  return lookup_at(scene, hit, surface, slot, footprint);
}

bool surface_tangents(const SceneData& scene, const Hit& hit, const Surface& surface, int uv_set, const V3f& normal,
                      V3f& tangent, V3f& bitangent) {
  if (surface.part->mesh) {
    if (uv_set < 0 || uv_set >= kMaxTexcoordSets) uv_set = 0;
    return tangent_frame(scene, hit, *surface.part, uv_set, normal, tangent, bitangent);
  }
  V3f axis(0, 1, 0);
  if (hit.instance != kNoHit) axis = scene.instances[hit.instance].direction(axis);
  tangent = cross(normal, axis);
  if (!normalizable(tangent)) return false;
  tangent = normalize(tangent);
  bitangent = cross(tangent, normal);
  return true;
}

bool surface_derivatives(const SceneData& scene, const Hit& hit, const Surface& surface, int uv_set, V3f& dp_du,
                         V3f& dp_dv) {
  const PartRecord& part = *surface.part;
  if (part.mesh) {
    if (uv_set < 0 || uv_set >= kMaxTexcoordSets) return false;
    const auto& uvs = part.mesh->texcoords[std::size_t(uv_set)];
    if (uvs.empty()) return false;
    const std::uint32_t* i = &part.mesh->indices[3 * std::size_t(hit.primitive)];
    const V2f d1 = uvs[i[1]] - uvs[i[0]], d2 = uvs[i[2]] - uvs[i[0]];
    const float determinant = d1.x * d2.y - d1.y * d2.x;
    if (!(std::fabs(determinant) > 1e-20f)) return false;
    const V3f e1 = part.mesh->positions[i[1]] - part.mesh->positions[i[0]];
    const V3f e2 = part.mesh->positions[i[2]] - part.mesh->positions[i[0]];
    dp_du = (e1 * d2.y - e2 * d1.y) / determinant;
    dp_dv = (e2 * d1.x - e1 * d2.x) / determinant;
  } else {
    // sphere_uv(): u a turn about the y axis, v half a turn down from it.
    const V3f d = hit.instance == kNoHit ? surface.geometric_normal : normalize_any(hit.normal);
    const float sine = std::sqrt(d.x * d.x + d.z * d.z);
    if (!(sine > 1e-6f)) return false;
    dp_du = V3f(-d.z, 0, d.x) * (kTwoPi * part.radius);
    dp_dv = V3f(d.x * d.y / sine, -sine, d.z * d.y / sine) * (kPi * part.radius);
  }
  if (hit.instance != kNoHit) {
    dp_du = scene.instances[hit.instance].direction(dp_du);
    dp_dv = scene.instances[hit.instance].direction(dp_dv);
  }
  return is_finite(dp_du) && is_finite(dp_dv);
}

// With z along the geometric normal, the normal in the x-z plane at angle f from z and rho e^(i d) the part of wo in
// that plane, the mirror image r = 2 (n . wo) n - wo has r_z = wo_x sin 2f + wo_z cos 2f = rho cos(2f - d): it falls
// from wo_z at f = 0 to the least allowed value t at 2f = d + acos(t / rho). (The condition is that of Cycles'
// ensure_valid_specular_reflection and of Keller et al. 2017, "The Iray Light Transport Simulation and Rendering
// System", which solve for it otherwise.)
V3f bend_for_reflection(const V3f& normal, const V3f& geometric, const V3f& wo) {
  constexpr float kLeastCosine = 0.01f;
  const float wo_z = dot(geometric, wo);
  const float least = std::min(0.9f * wo_z, kLeastCosine);  // a reflection may be as shallow as the view
  if (2 * dot(normal, wo) * dot(normal, geometric) - wo_z >= least) return normal;
  const V3f across = normal - geometric * dot(normal, geometric);
  if (!(wo_z > 0) || !normalizable(across)) return geometric;
  const V3f x = normalize(across);
  const float wo_x = dot(x, wo), rho = std::sqrt(wo_x * wo_x + wo_z * wo_z);
  const float angle = 0.5f * (std::atan2(wo_x, wo_z) + std::acos(std::min(least / rho, 1.0f)));
  return normalize(geometric * std::cos(angle) + x * std::sin(angle));
}

namespace {

// Of the vertices, on the side of the geometric normal; that one where there are none.
V3f vertex_normal(const SceneData& scene, const Hit& hit, const Surface& s) {
  const PartRecord& part = *s.part;
  if (!part.smooth) return s.geometric_normal;
  V3f n = interpolate(part.mesh->normals, *part.mesh, hit.primitive, s.barycentric);
  if (hit.instance != kNoHit) n = scene.instances[hit.instance].normal(n);
  if (!normalizable(n)) return s.geometric_normal;
  n = normalize(n);
  return dot(n, s.geometric_normal) < 0 ? -n : n;
}

// `map`: null: none.
V3f unbent_normal_with_map(const SceneData& scene, const Hit& hit, float footprint, const Surface& s,
                           const TextureSlot* map, float scale) {
  const PartRecord& part = *s.part;
  V3f normal = vertex_normal(scene, hit, s);
  if (!map) return normal;
  V3f tangent, bitangent;
  if (map == &scene.description.materials[part.material].bump_texture) {
    normal = bumped_normal(scene, hit, s, *map, scale, normal);
  } else if (tangent_frame(scene, hit, part, map->texcoord, normal, tangent, bitangent)) {
    const V4f texel = lookup_at(scene, hit, s, *map, footprint);
    const V3f local((2 * texel.x - 1) * scale, (2 * texel.y - 1) * scale, 2 * texel.z - 1);
    const V3f mapped = tangent * local.x + bitangent * local.y + normal * local.z;
    if (normalizable(mapped)) normal = normalize(mapped);
  }
  // A map may turn the normal below the surface: what is seen from the front must keep facing the front.
  const float below = dot(normal, s.geometric_normal);
  if (below < 0.01f) normal = normalize(normal + s.geometric_normal * (0.01f - below));
  return normal;
}

}  // namespace

V3f bend_normal(const V3f& unbent, const Surface& s, const V3f& wo, bool front) {
  const float side = front ? 1.0f : -1.0f;
  if (s.material->specular) return bend_for_reflection(unbent * side, s.geometric_normal * side, wo) * side;
  // Keep the viewer in the upper hemisphere of the shading normal: bend it towards the viewer by the missing amount.
  const float visible = side * dot(unbent, wo);
  if (!(visible < kLeastVisible)) return unbent;
  const V3f bent = unbent + wo * (side * (kLeastVisible - visible));
  const V3f normal = normalizable(bent) ? normalize(bent) : s.geometric_normal;
  return side * dot(normal, wo) > 0 && dot(normal, s.geometric_normal) > 0 ? normal : s.geometric_normal;
}

V3f normal_with_map(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, const Surface& s,
                    const TextureSlot* map, float scale) {
  if (!s.part->mesh) return s.geometric_normal;
  return bent_normal(unbent_normal_with_map(scene, hit, footprint, s, map, scale), s, wo, s.front);
}

V3f unbent_normal(const SceneData& scene, const Hit& hit, float footprint, const Surface& s) {
  if (!s.part->mesh) return s.geometric_normal;
  const Material& material = scene.description.materials[s.part->material];
  const TextureSlot* map = nullptr;
  if (s.material->normal_mapped)
    map = material.normal_texture.present() ? &material.normal_texture : &material.bump_texture;
  const float scale = material.normal_texture.present() ? material.normal_scale : material.bump_scale;
  return unbent_normal_with_map(scene, hit, footprint, s, map, scale);
}

void interpolate_normal(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, Surface& s) {
  if (s.part->mesh) s.shading_normal = bent_normal(unbent_normal(scene, hit, footprint, s), s, wo, s.front);
}

Rgb evaluate_base_color(const SceneData& scene, const Hit& hit, float footprint, const Surface& s) {
  Rgb color = s.material->params.base_color;
  if (const TriangleMesh* mesh = s.part->mesh; mesh && !mesh->colors.empty()) {
    const V4f c = interpolate(mesh->colors, *mesh, hit.primitive, s.barycentric);
    color *= Rgb(c.x, c.y, c.z);
  }
  if (!s.material->textured) return color;
  const TextureSlot& slot = scene.description.materials[s.part->material].base_color_texture;
  if (slot.present()) {
    const V4f c = lookup_at(scene, hit, s, slot, footprint);
    color *= Rgb(c.x, c.y, c.z);
  }
  return color;
}

SurfaceParams evaluate_material(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                                const Surface& s) {
  SurfaceParams p = s.material->params;
  if (s.material->scatters_mapped) set_mapped_normal(scene, hit, wo, footprint, s, p);
  if (p.model == LobeModel::blend) {
    p.blend = evaluate_blend_parts(scene, hit, wo, footprint, s);
    return p;
  }
  if (s.material->numbers_textured) apply_number_textures(scene, hit, footprint, s, p);
  if (is_anisotropic(p.distribution))
    p.along = anisotropy_direction(scene, hit, s, scattering_frame(s, p), 0, V2f(1, 0));
  p.base_color = evaluate_base_color(scene, hit, footprint, s);
  if (!s.material->textured) return p;
  const Material& m = scene.description.materials[s.part->material];
  const auto lookup = [&](const TextureSlot& slot) { return lookup_at(scene, hit, s, slot, footprint); };
  if (m.metallic_roughness_texture.present()) {
    const V4f c = lookup(m.metallic_roughness_texture);
    p.alpha = sqr(m.roughness * c.y);
    p.metallic *= c.z;
  }
  if (m.specular_texture.present()) p.specular *= lookup(m.specular_texture).w;
  if (m.specular_color_texture.present()) {
    const V4f c = lookup(m.specular_color_texture);
    p.specular_color *= Rgb(c.x, c.y, c.z);
  }
  if (m.transmission_texture.present()) p.transmission *= lookup(m.transmission_texture).x;
  if (m.specular_glossiness_texture.present()) {
    const V4f c = lookup(m.specular_glossiness_texture);
    p.f0 *= Rgb(c.x, c.y, c.z);
    p.alpha = sqr(1 - m.glossiness * c.w);
  }
  return p;
}

Rgb surface_emission(const SceneData& scene, const Hit& hit, const Surface& s) {
  if (!s.front && !s.material->double_sided) return Rgb(0, 0, 0);
  Rgb emission = s.material->emission;
  const Material& m = scene.description.materials[s.part->material];
  const TextureSlot& slot = s.material->unlit ? m.base_color_texture : m.emission_texture;
  if (slot.present()) {
    const V4f c = scene.textures->lookup(slot, surface_uv_at(hit, s, slot.texcoord));
    emission *= Rgb(c.x, c.y, c.z);
  }
  if (s.material->unlit && s.part->mesh && !s.part->mesh->colors.empty()) {
    const V4f c = interpolate(s.part->mesh->colors, *s.part->mesh, hit.primitive, s.barycentric);
    emission *= Rgb(c.x, c.y, c.z);
  }
  return emission;
}

float surface_alpha(const SceneData& scene, const PartRecord& part, std::uint32_t primitive, const V2f& barycentric,
                    const V3f& normal) {
  const Material& m = scene.description.materials[part.material];
  float alpha = m.base_alpha;
  if (const TextureSlot& slot = alpha_slot(m); slot.present()) {
    const V2f uv = part.mesh ? surface_uv(part, primitive, barycentric, slot.texcoord) : sphere_uv(normal);
    alpha *= scene.textures->lookup(slot, uv).w;
  }
  if (part.mesh && !part.mesh->colors.empty()) {
    alpha *= interpolate(part.mesh->colors, *part.mesh, primitive, barycentric).w;
  }
  return alpha;
}

}  // namespace helio
