// Vector types (Imath) and the few operations that light transport adds to them.
#pragma once

#include <ImathBox.h>
#include <ImathMatrix.h>
#include <ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace helio {

using Imath::Box3d;
using Imath::Box3f;
using Imath::M44d;  // row vectors: p' = p * M, translation in row 3
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;
using Imath::V4f;

// Linear RGB radiance, reflectance or throughput (sRGB/Rec.709 primaries).
using Rgb = V3f;

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;
inline constexpr float kTwoPi = 2.0f * kPi;
// The largest float below 1: what a uniform variate in [0, 1) may reach.
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

template <class T>
inline T dot(const Imath::Vec3<T>& a, const Imath::Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
inline Imath::Vec3<T> cross(const Imath::Vec3<T>& a, const Imath::Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
inline T length_squared(const Imath::Vec3<T>& v) {
  return dot(v, v);
}

template <class T>
inline T length(const Imath::Vec3<T>& v) {
  return std::sqrt(dot(v, v));
}

// Unit vector along v. Precondition: v is finite and its squared length neither under- nor overflows.
template <class T>
inline Imath::Vec3<T> normalize(const Imath::Vec3<T>& v) {
  return v * (T(1) / length(v));
}

// As normalize, for any finite v: lengths whose squares under- or overflow float are scaled first. Zero stays zero.
inline V3f normalize_any(const V3f& v) {
  const float squared = length_squared(v);
  if (squared >= 1e-30f && squared <= 1e30f) [[likely]]
    return v * (1.0f / std::sqrt(squared));
  const V3d d(v);
  const double l = length(d);
  return l > 0 ? V3f(d / l) : V3f(0, 0, 0);
}

inline float luminance(const Rgb& c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}
inline float max_component(const Rgb& c) {
  return std::max(c.x, std::max(c.y, c.z));
}
inline bool is_black(const Rgb& c) {
  return c.x == 0 && c.y == 0 && c.z == 0;
}
inline bool is_finite(const V3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
inline bool is_finite(const V3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
inline float sqr(float x) {
  return x * x;
}
inline float safe_sqrt(float x) {
  return std::sqrt(std::max(0.0f, x));
}

// Orthonormal frame around a unit normal n (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
struct Frame {
  V3f s, t, n;

  Frame() = default;
  explicit Frame(const V3f& normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    s = V3f(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    t = V3f(b, sign + n.y * n.y * a, -n.y);
  }

  V3f to_local(const V3f& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  V3f to_world(const V3f& v) const { return s * v.x + t * v.y + n * v.z; }
};

// Half-open pixel rectangle [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  std::int64_t area() const { return std::int64_t(width()) * height(); }
  bool empty() const { return x1 <= x0 || y1 <= y0; }
  bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  bool operator==(const PixelRect&) const = default;
};

inline PixelRect intersect(const PixelRect& a, const PixelRect& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

}  // namespace helio
