#include "renderer/trace/scene/surface_bump.h"

namespace helio {

namespace {

// Derivatives of the height along u and v. A bilinear lookup is linear in either coordinate from one centre of a texel
// to the next: the difference of the two is its slope.
V2f height_slopes(const TextureTable& textures, const TextureSlot& slot, const V2f& uv) {
  const std::array<float, 6>& m = slot.uv_transform;
  const V2f at(m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]);
  if (!std::isfinite(at.x) || !std::isfinite(at.y) || slot.filter == FilterMode::nearest) return {0, 0};
  TextureSlot plain = slot;
  plain.uv_transform = {1, 0, 0, 0, 1, 0};
  const auto height = [&](float u, float v) {
    const V4f t = textures.lookup(plain, V2f(u, v));
    return luminance(Rgb(t.x, t.y, t.z));
  };
  const float width = float(textures.width(slot.image)), rows = float(textures.height(slot.image));
  const float left = (std::floor(at.x * width - 0.5f) + 0.5f) / width;
  const float above = (std::floor(at.y * rows - 0.5f) + 0.5f) / rows;
  const V2f slope((height(left + 1 / width, at.y) - height(left, at.y)) * width,
                  (height(at.x, above + 1 / rows) - height(at.x, above)) * rows);
  return {slope.x * m[0] + slope.y * m[3], slope.x * m[1] + slope.y * m[4]};
}

}  // namespace

V3f bumped_normal(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& height,
                  float scale, const V3f& normal) {
  V3f e1, e2;
  if (!surface_derivatives(scene, hit, surface, height.texcoord, e1, e2)) return normal;
  e1 = e1 - normal * dot(normal, e1);
  e2 = e2 - normal * dot(normal, e2);
  const V3f across = cross(e1, e2);
  const float area2 = length_squared(across);
  if (!(area2 > 0) || !std::isfinite(area2)) return normal;
  const V2f slopes = height_slopes(*scene.textures, height, surface_uv_at(hit, surface, height.texcoord)) * scale;
  // The gradient g has g . e1 and g . e2 equal to the rise along u and v.
  const V3f gradient = (cross(e2, across) * slopes.x + cross(across, e1) * slopes.y) / area2;
  const V3f bumped = normal - gradient;
  const float squared = length_squared(bumped);
  return squared > 1e-30f && squared < 1e30f ? normalize(bumped) : normal;
}

}  // namespace helio
