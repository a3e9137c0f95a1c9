// Lights for tests, ray hits on them computed in double apart from the code under test, and closed-form irradiances.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "renderer/scene/images/environment.h"
#include "renderer/trace/lights/light_sampler.h"
#include "tests/support/random.h"

namespace helio::test {

inline AreaEmitter triangle_emitter(const V3f& a, const V3f& b, const V3f& c, float radiance, bool two_sided = false) {
  AreaEmitter e;
  e.p0 = a;
  e.e1 = b - a;
  e.e2 = c - a;
  e.normal = V3f(normalize(cross(V3d(e.e1), V3d(e.e2))));
  e.radiance = Rgb(radiance);
  e.two_sided = two_sided;
  return e;
}

// The two triangles of the parallelogram a, a + e1, a + e1 + e2, a + e2; the front is on the side of e1 x e2.
inline void add_quad(std::vector<AreaEmitter>& out, const V3f& a, const V3f& e1, const V3f& e2, float radiance,
                     bool two_sided = false) {
  out.push_back(triangle_emitter(a, a + e1, a + e1 + e2, radiance, two_sided));
  out.push_back(triangle_emitter(a, a + e1 + e2, a + e2, radiance, two_sided));
}

inline AreaEmitter sphere_emitter(const V3f& center, float radius, float radiance, bool two_sided = false) {
  AreaEmitter e;
  e.shape = AreaEmitter::Shape::sphere;
  e.p0 = center;
  e.e1 = V3f(radius, 0, 0);
  e.radiance = Rgb(radiance);
  e.two_sided = two_sided;
  return e;
}

// The unit sphere under (x, y, z) -> center + x e1 + y e2 + z e3.
inline AreaEmitter ellipsoid_emitter(const V3f& center, const V3f& e1, const V3f& e2, const V3f& e3, float radiance,
                                     bool two_sided = false) {
  AreaEmitter e;
  e.shape = AreaEmitter::Shape::ellipsoid;
  e.p0 = center;
  e.e1 = e1;
  e.e2 = e2;
  e.e3 = e3;
  e.radiance = Rgb(radiance);
  e.two_sided = two_sided;
  return e;
}

struct EmitterHit {
  std::uint32_t emitter = 0;
  float distance = 0;
  float cos_light = 0;  // between the front normal and the way back
  V2f uv{0, 0};         // of triangles: interpolated from the corners; else that of the longitude and latitude
};

// Nearest intersection of a ray with one emitter, front or back.
inline std::optional<EmitterHit> hit_emitter(const AreaEmitter& e, const V3f& point, const V3f& direction) {
  const V3d o(point), d = normalize(V3d(direction));
  EmitterHit hit;
  if (e.shape == AreaEmitter::Shape::sphere) {
    const V3d to_center = V3d(e.p0) - o;
    const double along = dot(to_center, d), r = double(e.e1.x);
    const double root = r * r - length_squared(to_center - d * along);
    if (root < 0) return std::nullopt;
    const bool inside = length_squared(to_center) <= r * r;
    const double t = inside ? along + std::sqrt(root) : along - std::sqrt(root);
    if (t <= 0) return std::nullopt;
    hit.distance = float(t);
    const V3d normal = normalize(o + d * t - V3d(e.p0));
    hit.cos_light = float(-dot(normal, d));
    hit.uv = environment_uv(V3f(normal));
    return hit;
  }
  if (e.shape == AreaEmitter::Shape::ellipsoid) {
    // |M (o + t d - c)| = 1 for the inverse M of the map, whose rows are cofactors over the determinant.
    const V3d a(e.e1), b(e.e2), c(e.e3), rows[3] = {cross(b, c), cross(c, a), cross(a, b)};
    const double determinant = dot(a, rows[0]);
    const auto invert = [&](const V3d& v) {
      return V3d(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)) * (1 / determinant);
    };
    const V3d p = invert(o - V3d(e.p0)), q = invert(d);
    const double qq = dot(q, q), pq = dot(p, q), root = pq * pq - qq * (dot(p, p) - 1);
    if (root < 0) return std::nullopt;
    const bool inside = dot(p, p) <= 1;
    const double t = (-pq + (inside ? 1 : -1) * std::sqrt(root)) / qq;
    if (t <= 0) return std::nullopt;
    const V3d local = p + q * t;
    const V3d normal = normalize((rows[0] * local.x + rows[1] * local.y + rows[2] * local.z) * determinant);
    hit.distance = float(t);
    hit.cos_light = float(-dot(normal, d));
    hit.uv = environment_uv(V3f(local));
    return hit;
  }
  const V3d e1(e.e1), e2(e.e2), n = cross(e1, e2), to_corner = V3d(e.p0) - o;
  const double facing = dot(n, d);
  if (facing == 0) return std::nullopt;
  const double t = dot(n, to_corner) / facing;
  const V3d in_plane = d * t - to_corner;
  const double s = dot(cross(in_plane, e2), n) / length_squared(n), q = dot(cross(e1, in_plane), n) / length_squared(n);
  const double edge = 1e-6;
  if (t <= 0 || s < -edge || q < -edge || s + q > 1 + edge) return std::nullopt;
  hit.distance = float(t);
  hit.cos_light = float(-dot(V3d(e.normal), d));
  hit.uv = e.uv[0] * float(1 - s - q) + e.uv[1] * float(s) + e.uv[2] * float(q);
  return hit;
}

// The emitter that a sampled direction meets at the sampled distance.
inline std::optional<EmitterHit> hit_at(const std::vector<AreaEmitter>& emitters, const V3f& point,
                                        const V3f& direction, float distance) {
  for (std::uint32_t i = 0; i < emitters.size(); ++i) {
    std::optional<EmitterHit> hit = hit_emitter(emitters[i], point, direction);
    if (hit && std::abs(hit->distance - distance) <= 2e-4f * distance) {
      hit->emitter = i;
      return hit;
    }
  }
  return std::nullopt;
}

// Irradiance at `point` on a surface with normal n from a polygon of radiance 1 that lies above the horizon, corners
// in order (Lambert 1760): 1/2 sum over edges of (angle of the edge) n . (edge normal).
inline double polygon_irradiance(const std::vector<V3f>& corners, const V3f& point, const V3f& n) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const V3d a = V3d(corners[i]) - V3d(point), b = V3d(corners[(i + 1) % corners.size()]) - V3d(point);
    const V3d normal = cross(a, b);
    sum += std::atan2(length(normal), dot(a, b)) * dot(normalize(normal), V3d(n));
  }
  return std::abs(0.5 * sum);
}

inline double quad_irradiance(const V3f& a, const V3f& e1, const V3f& e2, const V3f& point, const V3f& n) {
  return polygon_irradiance({a, a + e1, a + e1 + e2, a + e2}, point, n);
}

// From a sphere of radiance 1 above the horizon: pi (r / d)^2 cos.
inline double sphere_irradiance(const V3f& center, double radius, const V3f& point, const V3f& n) {
  const V3d d = V3d(center) - V3d(point);
  return std::numbers::pi * radius * radius * dot(V3d(n), d) / std::pow(length(d), 3);
}

struct Estimate {
  double mean = 0, deviation = 0;  // deviation: of one sample
  double standard_error = 0;
};

// Irradiance (red) by `count` samples, everything unoccluded.
inline Estimate estimate_irradiance(const LightSampler& lights, const V3f& point, const V3f& normal, int count,
                                    std::uint64_t seed, bool pass_normal = true) {
  Random random(seed);
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const float u_select = random.next_float();
    const LightSample s = lights.sample(point, pass_normal ? normal : V3f(0, 0, 0), u_select, random.next_v2f());
    if (!(s.pdf_w > 0)) continue;
    const double value = std::max(0.0, double(dot(normal, s.direction))) * s.radiance.x / s.pdf_w;
    sum += value;
    squares += value * value;
  }
  Estimate e;
  e.mean = sum / count;
  e.deviation = std::sqrt(std::max(0.0, squares / count - e.mean * e.mean));
  e.standard_error = e.deviation / std::sqrt(double(count));
  return e;
}

}  // namespace helio::test
