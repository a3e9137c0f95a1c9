// Normal and bump maps that give scattering a frame of its own: trace/scene/surface_map.cpp.
#ifndef SURFACE_MAP_GLSL
#define SURFACE_MAP_GLSL

#include "scene/surface.glsl"

vec3 mirrored_in(vec3 normal, vec3 v) {
  return v - normal * (2 * dot(normal, v));
}

// The map's normal, which texels give in the frame (u, n x u, n); `normal` itself where the map says nothing.
vec3 map_lookup(Hit hit, Surface s, vec3 normal) {
  const TextureSlotTable map = material_of(s.material).normal_texture;
  if (!texture_present(map))
    return bumped_normal(hit, s, material_of(s.material).bump_texture, material_of(s.material).bump_scale, normal);
  vec3 dp_du, dp_dv;
  if (!surface_derivatives(hit, s, map.texcoord, dp_du, dp_dv)) return normal;
  const vec3 u = normalize_any(dp_du - normal * dot(normal, dp_du));
  if (!(length_squared(u) > 0.5)) return normal;
  const vec4 texel = surface_texel(hit, s, map);
  const vec3 mapped = u * (2 * texel.x - 1) + cross(normal, u) * (2 * texel.y - 1) + normal * (2 * texel.z - 1);
  const vec3 unit = normalize_any(mapped);
  return is_finite(unit) && length_squared(unit) > 0.5 ? unit : normal;
}

// Sets mapped, map_normal and map_alpha2 of `p`.
void set_mapped_normal(Hit hit, vec3 wo, Surface s, inout LobeParams p) {
  const uint flags = material_of(s.material).flags;
  vec3 base = s.shading_normal, mapped = map_lookup(hit, s, base);
  const bool mirror = (flags & kMaterialMapMirrored) != 0 && !s.front;
  if (mirror) {
    mapped = mirrored_in(base, mapped);
    base = -base;
  }
  if (material_of(s.material).map_rule == kMapOwnFrame && dot(wo, base) * dot(wo, mapped) <= 0)
    mapped = -mirrored_in(base, mapped);
  // The frame of a surface that does not tell its sides apart is on the viewer's side.
  if (!mirror && !s.front && (flags & kMaterialVolume) == 0) mapped = -mapped;
  p.mapped = 1;
  p.map_normal = to_local(shading_frame(s), mapped);
  const float cos2 = min(1.0, sqr(p.map_normal.z));
  p.map_alpha2 = 0;
  if ((flags & kMaterialMapShadowing) != 0) p.map_alpha2 = cos2 > 0 ? min(1.0, 0.125 * (1 - cos2) / cos2) : 1.0;
}

// The frame, in world space, that the directions of `p` are in.
Frame scattering_frame(Surface s, LobeParams p) {
  const Frame frame = shading_frame(s);
  if (p.mapped == 0) return frame;
  const Frame inner = make_frame(p.map_normal);
  return Frame(to_world(frame, inner.s), to_world(frame, inner.t), to_world(frame, inner.n));
}

// The tangent of the first texture coordinates in `frame` (anisotropy_direction() of surface_layers.cpp). Without
// tangents any direction is as good: the frame's own.
vec2 tangent_direction(Hit hit, Surface s, Frame frame) {
  vec3 tangent, bitangent;
  if (!surface_tangents(hit, s, 0, s.shading_normal, tangent, bitangent)) return vec2(1, 0);
  const vec2 local = vec2(dot(tangent, frame.s), dot(tangent, frame.t));
  const float size = sqrt(dot(local, local));
  return size > 1e-6 ? local / size : vec2(1, 0);
}

#endif
