#include "renderer/trace/surface_bump.h"

namespace helio {

namespace {

// Derivatives of the height along u and v. Between texels a bilinear lookup is linear along each: a small step finds
// its slope, up to rounding; across the middle of a texel the slopes of both sides are mixed.
V2f height_slopes(const TextureTable& textures, const TextureSlot& slot, const V2f& uv) {
  constexpr float kStep = 1.0f / 16;  // of a texel
  const auto height = [&](float u, float v) {
    const V4f t = textures.lookup(slot, V2f(u, v));
    return luminance(Rgb(t.x, t.y, t.z));
  };
  const std::array<float, 6>& m = slot.uv_transform;
  const float du = kStep / (float(textures.width(slot.image)) * std::max(1e-6f, std::hypot(m[0], m[3])));
  const float dv = kStep / (float(textures.height(slot.image)) * std::max(1e-6f, std::hypot(m[1], m[4])));
  return {(height(uv.x + du, uv.y) - height(uv.x - du, uv.y)) / (2 * du),
          (height(uv.x, uv.y + dv) - height(uv.x, uv.y - dv)) / (2 * dv)};
}

}  // namespace

V3f bumped_normal(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& height,
                  float scale, const V3f& normal) {
  const TriangleMesh& mesh = *surface.part->mesh;
  if (height.texcoord < 0 || height.texcoord >= kMaxTexcoordSets) return normal;
  const std::vector<V2f>& uvs = mesh.texcoords[std::size_t(height.texcoord)];
  if (uvs.empty()) return normal;
  const std::uint32_t* i = &mesh.indices[3 * std::size_t(hit.primitive)];
  const auto edge = [&](std::uint32_t to) {
    V3f e = mesh.positions[to] - mesh.positions[i[0]];
    if (hit.instance != kNoHit) e = scene.instances[hit.instance].direction(e);
    return e - normal * dot(normal, e);
  };
  const V3f e1 = edge(i[1]), e2 = edge(i[2]), across = cross(e1, e2);
  const float area2 = length_squared(across);
  if (!(area2 > 0) || !std::isfinite(area2)) return normal;
  const V2f uv = surface_uv(*surface.part, hit.primitive, surface.barycentric, height.texcoord);
  const V2f slopes = height_slopes(*scene.textures, height, uv) * scale;
  const V2f d1 = uvs[i[1]] - uvs[i[0]], d2 = uvs[i[2]] - uvs[i[0]];
  // The gradient g has g . e1 and g . e2 equal to the rise along the edges.
  const float rise1 = slopes.x * d1.x + slopes.y * d1.y, rise2 = slopes.x * d2.x + slopes.y * d2.y;
  const V3f gradient = (cross(e2, across) * rise1 + cross(across, e1) * rise2) / area2;
  const V3f bumped = normal - gradient;
  const float squared = length_squared(bumped);
  return squared > 1e-30f && squared < 1e30f ? normalize(bumped) : normal;
}

void set_map_shadowing(const Surface& surface, const V3f& unmapped, const Frame& frame, SurfaceParams& params) {
  const float cosine = dot(unmapped, surface.shading_normal), cos2 = std::min(1.0f, cosine * cosine);
  params.unmapped_normal = frame.to_local(unmapped);
  params.map_alpha2 = cos2 > 0 ? std::min(1.0f, 0.125f * (1 - cos2) / cos2) : 1.0f;
}

}  // namespace helio
