#include "renderer/trace/scene/surface_map.h"

#include "renderer/trace/scene/surface_bump.h"

namespace helio {

namespace {

V3f mirrored_in(const V3f& normal, const V3f& v) {
  return v - normal * (2 * dot(normal, v));
}

// In the frame (u, n x u, n); `normal` itself where the map says nothing.
V3f map_lookup(const SceneData& scene, const Hit& hit, float footprint, const Surface& surface, const Material& m,
               const V3f& normal) {
  if (!m.normal_texture.present()) return bumped_normal(scene, hit, surface, m.bump_texture, m.bump_scale, normal);
  V3f dp_du, dp_dv;
  if (!surface_derivatives(scene, hit, surface, m.normal_texture.texcoord, dp_du, dp_dv)) return normal;
  const V3f u = normalize_any(dp_du - normal * dot(normal, dp_du));
  if (!(length_squared(u) > 0.5f)) return normal;
  const V4f texel = surface_texel(scene, hit, surface, m.normal_texture, footprint);
  const V3f mapped = u * (2 * texel.x - 1) + cross(normal, u) * (2 * texel.y - 1) + normal * (2 * texel.z - 1);
  const V3f unit = normalize_any(mapped);
  return is_finite(unit) && length_squared(unit) > 0.5f ? unit : normal;
}

}  // namespace

void set_mapped_normal(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint, const Surface& s,
                       SurfaceParams& params) {
  const Material& m = scene.description.materials[s.part->material];
  V3f base = s.shading_normal;
  V3f mapped = map_lookup(scene, hit, footprint, s, m, base);
  const bool mirror = m.map_mirrored && !s.front;
  if (mirror) {
    mapped = mirrored_in(base, mapped);
    base = -base;
  }
  if (m.map_rule == MapRule::own_frame && dot(wo, base) * dot(wo, mapped) <= 0) mapped = -mirrored_in(base, mapped);
  // The frame of a surface that does not tell its sides apart is on the viewer's side.
  if (!mirror && !s.front && !s.material->volume) mapped = -mapped;
  params.mapped = true;
  params.map_normal = shading_frame(s).to_local(mapped);
  const float cos2 = std::min(1.0f, sqr(params.map_normal.z));
  params.map_alpha2 = !m.map_shadowing ? 0.0f : cos2 > 0 ? std::min(1.0f, 0.125f * (1 - cos2) / cos2) : 1.0f;
}

Frame scattering_frame(const Surface& surface, const SurfaceParams& params) {
  const Frame frame = shading_frame(surface);
  if (!params.mapped) return frame;
  const Frame inner(params.map_normal);
  Frame own;
  own.s = frame.to_world(inner.s);
  own.t = frame.to_world(inner.t);
  own.n = frame.to_world(inner.n);
  return own;
}

}  // namespace helio
