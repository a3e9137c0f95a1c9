#include "renderer/trace/light_groups.h"

#include <array>

namespace helio {
namespace {

// Corners may miss each other by this share of the longest edge: transforms and the edges themselves round in float.
constexpr float kCornerTolerance = 1e-5f;
constexpr float kUvTolerance = 1e-4f;
// Largest 1 - cos between the normals of two halves.
constexpr float kNormalTolerance = 1e-6f;
// The other half of a quad follows it closely in the files that exporters write.
constexpr std::uint32_t kLookAhead = 8;

V3f corner(const AreaEmitter& e, int i) {
  return i == 0 ? e.p0 : e.p0 + (i == 1 ? e.e1 : e.e2);
}

bool same_emission(const AreaEmitter& a, const AreaEmitter& b) {
  return a.radiance == b.radiance && a.two_sided == b.two_sided && a.texture == b.texture;
}

bool usable(const AreaEmitter& e) {
  return is_finite(e.radiance) && !is_black(e.radiance);
}

AreaLight single_light(const AreaEmitter& e) {
  AreaLight light;
  if (e.shape == AreaEmitter::Shape::sphere) {
    light.shape = make_sphere_shape(e.p0, e.e1.x, e.two_sided);
    return light;
  }
  light.shape = make_triangle_shape(e.p0, e.e1, e.e2, e.normal, e.two_sided);
  light.uv = e.uv[0];
  light.uv_s = e.uv[1] - e.uv[0];
  light.uv_t = e.uv[2] - e.uv[0];
  return light;
}

// The corner of `b` that is not on the edge of `a` opposite its corner `apex`, when that edge is shared; else -1.
// partner[j] receives the corner of b that coincides with corner j of a.
int far_corner(const AreaEmitter& a, int apex, const AreaEmitter& b, float tolerance, std::array<int, 3>& partner) {
  int used = 0;
  for (int j = 0; j < 3; ++j) {
    if (j == apex) continue;
    partner[j] = -1;
    for (int i = 0; i < 3; ++i) {
      if (length(corner(b, i) - corner(a, j)) <= tolerance) partner[j] = i;
    }
    if (partner[j] < 0) return -1;
    used |= 1 << partner[j];
  }
  return used == 6 ? 0 : used == 5 ? 1 : used == 3 ? 2 : -1;
}

bool differs(const V2f& a, const V2f& b) {
  return !(std::abs(a.x - b.x) <= kUvTolerance && std::abs(a.y - b.y) <= kUvTolerance);
}

// The parallelogram whose one half is `a`, with corner `apex` opposite the diagonal, and whose other half is `b`;
// shape.area is 0 when they do not make one.
AreaLight join(const AreaEmitter& a, int apex, const AreaEmitter& b) {
  AreaLight light;
  const int s = (apex + 1) % 3, t = (apex + 2) % 3;
  const V3f p0 = corner(a, apex), e1 = corner(a, s) - p0, e2 = corner(a, t) - p0;
  const float tolerance = kCornerTolerance * std::max({length(e1), length(e2), length(e2 - e1)});
  std::array<int, 3> partner{};
  const int far = far_corner(a, apex, b, tolerance, partner);
  if (far < 0 || !(length(p0 + e1 + e2 - corner(b, far)) <= tolerance)) return light;
  light.uv = a.uv[apex];
  light.uv_s = a.uv[s] - light.uv;
  light.uv_t = a.uv[t] - light.uv;
  if (a.texture.present() && (differs(light.uv + light.uv_s + light.uv_t, b.uv[far]) ||
                              differs(a.uv[s], b.uv[partner[s]]) || differs(a.uv[t], b.uv[partner[t]]))) {
    return light;
  }
  light.shape = make_parallelogram_shape(p0, e1, e2, a.normal, a.two_sided);
  return light;
}

AreaLight join(const AreaEmitter& a, const AreaEmitter& b) {
  AreaLight light;
  if (b.shape != AreaEmitter::Shape::triangle || !usable(b) || !same_emission(a, b) ||
      !(dot(a.normal, b.normal) >= 1 - kNormalTolerance) || !(single_light(b).shape.area > 0)) {
    return light;
  }
  for (int apex = 0; apex < 3 && !(light.shape.area > 0); ++apex) light = join(a, apex, b);
  return light;
}

}  // namespace

AreaLights group_area_emitters(const std::vector<AreaEmitter>& emitters) {
  AreaLights out;
  out.light_of_emitter.assign(emitters.size(), kNoLight);
  for (std::uint32_t i = 0; i < emitters.size(); ++i) {
    const AreaEmitter& e = emitters[i];
    if (out.light_of_emitter[i] != kNoLight || !usable(e)) continue;
    AreaLight light = single_light(e);
    if (!(light.shape.area > 0)) continue;
    const std::uint32_t index = std::uint32_t(out.lights.size());
    const std::uint32_t end = std::uint32_t(std::min<std::size_t>(emitters.size(), std::size_t(i) + 1 + kLookAhead));
    for (std::uint32_t j = i + 1; j < end && e.shape == AreaEmitter::Shape::triangle; ++j) {
      if (out.light_of_emitter[j] != kNoLight) continue;
      const AreaLight joined = join(e, emitters[j]);
      if (!(joined.shape.area > 0)) continue;
      light = joined;
      out.light_of_emitter[j] = index;
      break;
    }
    light.radiance = e.radiance;
    light.textured = e.texture.present() && e.shape == AreaEmitter::Shape::triangle;
    light.emitter = i;
    out.light_of_emitter[i] = index;
    out.lights.push_back(light);
  }
  return out;
}

}  // namespace helio
