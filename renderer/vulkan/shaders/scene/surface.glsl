// From a hit to a surface that scatters: trace/scene/surface.h and surface.cpp.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#include "lights/environment.glsl"
#include "base/frame.glsl"
#include "scene/geometry.glsl"
#include "scene/surface_params.glsl"
#include "scene/textures.glsl"

const float kOffsetFactor = 1.0 / 1048576.0;
const float kOffsetPerDistance = 1.0 / 2097152.0;
const float kMostRetreat = 64;

struct Surface {
  vec3 position;
  vec3 geometric_normal;  // unit, front side
  vec3 shading_normal;    // unit, same hemisphere as geometric_normal
  bool front;             // the ray arrived on the front side
  float offset, through;  // how far off the surface rays start that stay on its side, and that pass through
  float travelled;        // along the ray that arrived
  vec2 barycentric;
  uint part;              // part_index()
  uint material;
};

// The geometric normal on the side where the ray came from.
vec3 facing_normal(Surface s) {
  return s.front ? s.geometric_normal : -s.geometric_normal;
}

// The frame that materials scatter in: z on the viewer's side, except where a volume tells its sides apart.
Frame shading_frame(Surface s) {
  const bool flip = !s.front && (material_of(s.material).flags & kMaterialVolume) == 0;
  return make_frame(flip ? -s.shading_normal : s.shading_normal);
}

Surface make_surface(Ray ray, Hit hit) {
  Surface s;
  s.position = ray.origin + ray.direction * hit.t;
  s.travelled = hit.t;
  s.barycentric = vec2(hit.u, hit.v);
  s.part = part_index(hit.part, hit.instance);
  const PartTable part = part_at(s.part);
  vec3 normal = hit.normal;
  if (hit.instance != kNone) {
    const InstanceTable instance = instance_at(hit.instance);
    s.offset = part.offset * instance.offset_scale + instance.offset + hit.t * kOffsetPerDistance;
    s.through = s.offset;
    normal = instance_normal(instance, normal);
  } else {
    s.offset = part.offset + hit.t * kOffsetPerDistance;
    s.through = part.through + hit.t * kOffsetPerDistance;
    if (is_sphere(part)) {
      // A point on a sphere is refined onto it: the ray's parameter loses digits far away.
      normal = normalize_any(s.position - part.center);
      s.position = part.center + normal * part.radius;
    }
  }
  s.geometric_normal = normalize_any(normal);
  s.front = dot(s.geometric_normal, ray.direction) <= 0;
  s.shading_normal = s.geometric_normal;
  s.material = part.material;
  return s;
}

// ---- texture coordinates and tangents -------------------------------------------------------------------------------

vec2 sphere_uv(vec3 local_direction) {
  return environment_uv(local_direction);
}

// Texture coordinates at a hit, of spheres too.
vec2 surface_uv_at(Hit hit, Surface s, int set) {
  const PartTable part = part_at(s.part);
  if (is_sphere(part)) return sphere_uv(hit.instance == kNone ? s.geometric_normal : hit.normal);
  return texcoord_of(part, hit.primitive, s.barycentric, set);
}

vec4 surface_texel(Hit hit, Surface s, TextureSlotTable slot) {
  return texture_lookup(slot, surface_uv_at(hit, s, slot.texcoord));
}

vec3 to_world_direction(Hit hit, vec3 v) {
  return hit.instance == kNone ? v : instance_direction(instance_at(hit.instance), v);
}

// Tangent and bitangent of a triangle in world space; false where the texture coordinates do not span the surface.
bool tangent_frame(Hit hit, Surface s, int uv_set, vec3 normal, out vec3 tangent, out vec3 bitangent) {
  const PartTable part = part_at(s.part);
  tangent = vec3(0);
  bitangent = vec3(0);
  if (part.tangents != 0) {
    const vec4 t = interpolate_vec4(part.tangents, part, hit.primitive, s.barycentric);
    tangent = to_world_direction(hit, t.xyz);
    tangent = tangent - normal * dot(tangent, normal);
    if (!normalizable(tangent)) return false;
    tangent = normalize_any(tangent);
    bitangent = cross(normal, tangent) * (t.w < 0 ? -1.0 : 1.0);
    return true;
  }
  if (part.texcoords[uv_set] == 0) return false;
  const uvec3 i = corner_indices(part, hit.primitive);
  Vec2s uvs = Vec2s(part.texcoords[uv_set]);
  Vec3s positions = Vec3s(part.positions);
  const vec2 d1 = uvs.at[i.y] - uvs.at[i.x], d2 = uvs.at[i.z] - uvs.at[i.x];
  const vec3 e1 = to_world_direction(hit, positions.at[i.y] - positions.at[i.x]);
  const vec3 e2 = to_world_direction(hit, positions.at[i.z] - positions.at[i.x]);
  const float determinant = d1.x * d2.y - d1.y * d2.x;
  if (!(abs(determinant) > 1e-20)) return false;
  // The v axis of glTF's texture coordinates points down the image while its bitangent points up.
  tangent = (e1 * d2.y - e2 * d1.y) * (1 / determinant);
  const vec3 down = (e2 * d1.x - e1 * d2.x) * (1 / determinant);
  tangent = tangent - normal * dot(tangent, normal);
  if (!normalizable(tangent) || !normalizable(down)) return false;
  tangent = normalize_any(tangent);
  bitangent = cross(normal, tangent);
  if (dot(bitangent, down) > 0) bitangent = -bitangent;
  return true;
}

bool surface_tangents(Hit hit, Surface s, int uv_set, vec3 normal, out vec3 tangent, out vec3 bitangent) {
  if (!is_sphere(part_at(s.part)))
    return tangent_frame(hit, s, uv_set < 0 || uv_set >= int(kTexcoordSets) ? 0 : uv_set, normal, tangent, bitangent);
  tangent = cross(normal, to_world_direction(hit, vec3(0, 1, 0)));
  bitangent = vec3(0);
  if (!normalizable(tangent)) return false;
  tangent = normalize_any(tangent);
  bitangent = cross(tangent, normal);
  return true;
}

bool surface_derivatives(Hit hit, Surface s, int uv_set, out vec3 dp_du, out vec3 dp_dv) {
  const PartTable part = part_at(s.part);
  dp_du = vec3(0);
  dp_dv = vec3(0);
  if (!is_sphere(part)) {
    if (uv_set < 0 || uv_set >= int(kTexcoordSets) || part.texcoords[uv_set] == 0) return false;
    const uvec3 i = corner_indices(part, hit.primitive);
    Vec2s uvs = Vec2s(part.texcoords[uv_set]);
    Vec3s positions = Vec3s(part.positions);
    const vec2 d1 = uvs.at[i.y] - uvs.at[i.x], d2 = uvs.at[i.z] - uvs.at[i.x];
    const float determinant = d1.x * d2.y - d1.y * d2.x;
    if (!(abs(determinant) > 1e-20)) return false;
    const vec3 e1 = positions.at[i.y] - positions.at[i.x], e2 = positions.at[i.z] - positions.at[i.x];
    dp_du = (e1 * d2.y - e2 * d1.y) / determinant;
    dp_dv = (e2 * d1.x - e1 * d2.x) / determinant;
  } else {
    const vec3 d = hit.instance == kNone ? s.geometric_normal : normalize_any(hit.normal);
    const float sine = sqrt(d.x * d.x + d.z * d.z);
    if (!(sine > 1e-6)) return false;
    dp_du = vec3(-d.z, 0, d.x) * (kTwoPi * part.radius);
    dp_dv = vec3(d.x * d.y / sine, -sine, d.z * d.y / sine) * (kPi * part.radius);
  }
  dp_du = to_world_direction(hit, dp_du);
  dp_dv = to_world_direction(hit, dp_dv);
  return is_finite(dp_du) && is_finite(dp_dv);
}

// ---- shading normals ------------------------------------------------------------------------------------------------

#include "scene/surface_bump.glsl"

// The shading normal turned towards the geometric one so far that the mirror image of wo about it rises above the
// surface (Keller et al. 2017).
vec3 bend_for_reflection(vec3 normal, vec3 geometric, vec3 wo) {
  const float kLeastCosine = 0.01;
  const float wo_z = dot(geometric, wo);
  const float least = min(0.9 * wo_z, kLeastCosine);
  if (2 * dot(normal, wo) * dot(normal, geometric) - wo_z >= least) return normal;
  const vec3 across = normal - geometric * dot(normal, geometric);
  if (!(wo_z > 0) || !normalizable(across)) return geometric;
  const vec3 x = normalize_any(across);
  const float wo_x = dot(x, wo), rho = sqrt(wo_x * wo_x + wo_z * wo_z);
  const float angle = 0.5 * (atan(wo_x, wo_z) + acos(min(least / rho, 1.0)));
  return normalize_any(geometric * cos(angle) + x * sin(angle));
}

// The normal of the vertices, on the side of the geometric normal; the geometric normal where vertices have none.
vec3 vertex_normal(Hit hit, Surface s) {
  const PartTable part = part_at(s.part);
  if ((part.flags & kPartSmooth) == 0) return s.geometric_normal;
  vec3 n = interpolate_vec3(part.normals, part, hit.primitive, s.barycentric);
  if (hit.instance != kNone) n = instance_normal(instance_at(hit.instance), n);
  if (!normalizable(n)) return s.geometric_normal;
  n = normalize_any(n);
  return dot(n, s.geometric_normal) < 0 ? -n : n;
}

// Sets shading_normal from vertex normals and the maps of materials whose map bends it: interpolate_normal() and
// normal_with_map().
void interpolate_normal(Hit hit, vec3 wo, inout Surface s) {
  if (is_sphere(part_at(s.part))) return;
  const uint flags = material_of(s.material).flags;
  vec3 normal = vertex_normal(hit, s);
  if (has_feature(kFeatureNormalMaps) && (flags & kMaterialNormalMapped) != 0) {
    const TextureSlotTable map = material_of(s.material).normal_texture;
    if (!texture_present(map)) {
      normal = bumped_normal(hit, s, material_of(s.material).bump_texture, material_of(s.material).bump_scale, normal);
    } else {
      vec3 tangent, bitangent;
      if (tangent_frame(hit, s, map.texcoord, normal, tangent, bitangent)) {
        const vec4 texel = surface_texel(hit, s, map);
        const float scale = material_of(s.material).normal_scale;
        const vec3 mapped = tangent * ((2 * texel.x - 1) * scale) + bitangent * ((2 * texel.y - 1) * scale) +
                            normal * (2 * texel.z - 1);
        if (normalizable(mapped)) normal = normalize_any(mapped);
      }
    }
    // A map may turn the normal below the surface: what is seen from the front must keep facing the front.
    const float below = dot(normal, s.geometric_normal);
    if (below < 0.01) normal = normalize_any(normal + s.geometric_normal * (0.01 - below));
  }
  const float side = s.front ? 1.0 : -1.0;
  if ((flags & kMaterialSpecular) != 0) {
    s.shading_normal = bend_for_reflection(normal * side, s.geometric_normal * side, wo) * side;
    return;
  }
  // Keep the viewer in the upper hemisphere of the shading normal: bend it towards the viewer by the missing amount.
  const float visible = side * dot(normal, wo);
  const float kLeast = 1e-3;
  if (visible < kLeast) {
    const vec3 bent = normal + wo * (side * (kLeast - visible));
    normal = normalizable(bent) ? normalize_any(bent) : s.geometric_normal;
    if (!(side * dot(normal, wo) > 0) || !(dot(normal, s.geometric_normal) > 0)) normal = s.geometric_normal;
  }
  s.shading_normal = normal;
}

bool has_vertex_normals(Surface s) {
  return (part_at(s.part).flags & kPartSmooth) != 0;
}

// ---- emission -------------------------------------------------------------------------------------------------------

vec3 surface_emission(Hit hit, Surface s) {
  const uint flags = material_of(s.material).flags;
  if (!s.front && (flags & kMaterialDoubleSided) == 0) return vec3(0);
  vec3 emission = material_of(s.material).emission;
  if (!has_feature(kFeatureEmissionMaps)) return emission;
  const TextureSlotTable slot = material_of(s.material).emission_texture;
  if (texture_present(slot)) emission *= surface_texel(hit, s, slot).rgb;
  const PartTable part = part_at(s.part);
  if ((flags & kMaterialUnlit) != 0 && part.colors != 0)
    emission *= interpolate_vec4(part.colors, part, hit.primitive, s.barycentric).rgb;
  return emission;
}

// ---- where rays start -----------------------------------------------------------------------------------------------

// Where rays start on the side from which `arrived` came: `offset` off the surface, as far as possible back on the ray.
vec3 near_side_origin(Surface s, vec3 arrived) {
  const float cosine = abs(dot(s.geometric_normal, arrived));
  const float back = min(min(kMostRetreat * s.offset, s.offset / max(cosine, 1e-3)), s.travelled);
  const float lift = max(0.0, s.offset - back * cosine);
  return s.position - arrived * back + s.geometric_normal * (s.front ? lift : -lift);
}

vec3 origin_towards(Surface s, vec3 near_side, vec3 direction) {
  const float side = dot(s.geometric_normal, direction);
  if ((side >= 0) == s.front) return near_side;
  return s.position + s.geometric_normal * copysign(s.through, side);
}

// How far a shadow ray goes to a light's surface at `distance`: it stops short of the surface.
float shadow_length(float distance, float cos_light, float offset, float scene_radius) {
  const float margin = offset + (distance + scene_radius) * kOffsetFactor;
  return is_finite(distance) ? max(0.0, distance - margin / max(cos_light, 1e-3)) : distance;
}

#endif
