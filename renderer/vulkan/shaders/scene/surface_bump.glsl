// Normals of a surface that a texture displaces a little (Blinn 1978): trace/scene/surface_bump.cpp. Included by
// surface.glsl.

float bump_height(TextureSlotTable slot, float u, float v) {
  return luminance(texture_lookup(slot, vec2(u, v)).rgb);
}

// Derivatives of the height along u and v.
vec2 height_slopes(TextureSlotTable slot, vec2 uv) {
  const vec2 at = vec2(slot.uv_transform[0] * uv.x + slot.uv_transform[1] * uv.y + slot.uv_transform[2],
                       slot.uv_transform[3] * uv.x + slot.uv_transform[4] * uv.y + slot.uv_transform[5]);
  if (!is_finite(at.x) || !is_finite(at.y) || (slot.modes & kFilterNearest) != 0) return vec2(0);
  TextureSlotTable plain = slot;
  plain.uv_transform = float[6](1, 0, 0, 0, 1, 0);
  const vec2 size = vec2(texture_size(slot));
  const vec2 first = (floor(at * size - 0.5) + 0.5) / size;
  const float along_u =
      (bump_height(plain, first.x + 1 / size.x, at.y) - bump_height(plain, first.x, at.y)) * size.x;
  const float along_v =
      (bump_height(plain, at.x, first.y + 1 / size.y) - bump_height(plain, at.x, first.y)) * size.y;
  return vec2(along_u * slot.uv_transform[0] + along_v * slot.uv_transform[3],
              along_u * slot.uv_transform[1] + along_v * slot.uv_transform[4]);
}

vec3 bumped_normal(Hit hit, Surface s, TextureSlotTable height, float scale, vec3 normal) {
  vec3 e1, e2;
  if (!surface_derivatives(hit, s, height.texcoord, e1, e2)) return normal;
  e1 = e1 - normal * dot(normal, e1);
  e2 = e2 - normal * dot(normal, e2);
  const vec3 across = cross(e1, e2);
  const float area2 = length_squared(across);
  if (!(area2 > 0) || !is_finite(area2)) return normal;
  const vec2 slopes = height_slopes(height, surface_uv_at(hit, s, height.texcoord)) * scale;
  // The gradient g has g . e1 and g . e2 equal to the rise along u and v.
  const vec3 gradient = (cross(e2, across) * slopes.x + cross(across, e1) * slopes.y) / area2;
  const vec3 bumped = normal - gradient;
  return normalizable(bumped) ? normalize_any(bumped) : normal;
}
