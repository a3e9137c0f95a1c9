#include "renderer/trace/sampling/solid_angle_sampling.h"

namespace helio {
namespace {

// The part of v perpendicular to the unit vector w, normalized; zero when there is none.
V3f perpendicular_part(const V3f& v, const V3f& w) {
  const V3f rest = v - w * dot(v, w);
  const float squared = length_squared(rest);
  return squared > 0 ? rest * (1 / std::sqrt(squared)) : V3f(0, 0, 0);
}

// cos and sin of the angle at corner `a` between the great circles to b and to c.
void corner_angle(const V3f& a, const V3f& b, const V3f& c, float& cosine, float& sine) {
  const V3f ab = cross(a, b), ac = cross(a, c);
  const float scale = 1 / std::sqrt(std::max(length_squared(ab) * length_squared(ac), 1e-30f));
  cosine = std::clamp(dot(ab, ac) * scale, -1.0f, 1.0f);
  sine = std::clamp(std::abs(dot(a, cross(b, c))) * scale, 0.0f, 1.0f);  // |ab x ac| = |a| |a . (b x c)|
}

// The sum, in [0, 2 pi), of two angles in [0, pi) given as (cosine, sine) times any length.
float sum_of_angles(const V2f& a, const V2f& b) {
  const float angle = std::atan2(a.x * b.y + a.y * b.x, a.x * b.x - a.y * b.y);
  return angle < 0 ? angle + kTwoPi : angle;
}

}  // namespace

SphericalRectangle::SphericalRectangle(const V3f& point, const V3f& corner, const V3f& e1, const V3f& e2) {
  const float l1 = length(e1), l2 = length(e2);
  const V3f x = e1 * (1 / l1), y = e2 * (1 / l2), d = corner - point;
  x0_ = dot(d, x);
  y0_ = dot(d, y);
  z0_ = -std::abs(dot(d, cross(x, y)));
  x1_ = x0_ + l1;
  y1_ = y0_ + l2;
  const float zz = z0_ * z0_, h = -z0_;
  const float xx0 = x0_ * x0_, xx1 = x1_ * x1_, yy0 = y0_ * y0_, yy1 = y1_ * y1_;
  // Inner angles g_i of the spherical rectangle: cos g = -n_i . n_(i+1), sin g = |n_i x n_(i+1)|, up to |n_i|
  // |n_(i+1)|.
  k_ = kTwoPi - sum_of_angles({x0_ * y1_, h * std::sqrt(xx0 + yy1 + zz)}, {-x0_ * y0_, h * std::sqrt(xx0 + yy0 + zz)});
  solid_angle_ = std::max(
      0.0f,
      sum_of_angles({x1_ * y0_, h * std::sqrt(xx1 + yy0 + zz)}, {-x1_ * y1_, h * std::sqrt(xx1 + yy1 + zz)}) - k_);
  b0_ = -y0_ / std::sqrt(std::max(yy0 + zz, 1e-30f));
  b1_ = y1_ / std::sqrt(std::max(yy1 + zz, 1e-30f));
}

V2f SphericalRectangle::sample(const V2f& u) const {
  const float angle = u.x * solid_angle_ + k_;
  const float sine = std::sin(angle);
  const float fu = (std::cos(angle) * b0_ - b1_) / (std::abs(sine) > 1e-9f ? sine : std::copysign(1e-9f, sine));
  const float cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + b0_ * b0_), fu), -1.0f, 1.0f);
  const float xu = std::clamp(-(cu * z0_) / std::max(safe_sqrt(1 - cu * cu), 1e-7f), x0_, x1_);
  const float dd = xu * xu + z0_ * z0_;
  const float h0 = y0_ / std::sqrt(dd + y0_ * y0_), h1 = y1_ / std::sqrt(dd + y1_ * y1_);
  const float hv = h0 + u.y * (h1 - h0), rest = 1 - hv * hv;
  const float yv = rest > 1e-6f ? std::clamp(hv * std::sqrt(dd / rest), y0_, y1_) : (hv > 0 ? y1_ : y0_);
  return {std::clamp((xu - x0_) / (x1_ - x0_), 0.0f, 1.0f), std::clamp((yv - y0_) / (y1_ - y0_), 0.0f, 1.0f)};
}

SphericalTriangle::SphericalTriangle(const V3f& point, const V3f& p0, const V3f& e1, const V3f& e2) {
  const V3f d = p0 - point;
  const auto unit = [](const V3f& v) { return v * (1 / std::sqrt(std::max(length_squared(v), 1e-30f))); };
  a_ = unit(d);
  b_ = unit(d + e1);
  c_ = unit(d + e2);
  const float triple = std::abs(dot(a_, cross(b_, c_)));
  solid_angle_ = 2 * std::atan2(triple, 1 + dot(a_, b_) + dot(b_, c_) + dot(c_, a_));
  if (solid_angle_ < 0) solid_angle_ += kTwoPi;
}

V3f SphericalTriangle::sample(const V2f& u) const {
  float cos_alpha, sin_alpha;
  corner_angle(a_, b_, c_, cos_alpha, sin_alpha);
  // Corner c' on the arc ac such that (a, b, c') has the area u.x * solid_angle; eq. 1 to 3 of the paper.
  const float area = u.x * solid_angle_;
  const float s = std::sin(area), t = std::cos(area);
  const float sin_phi = s * cos_alpha - t * sin_alpha, cos_phi = t * cos_alpha + s * sin_alpha;
  const float k1 = cos_phi - cos_alpha, k2 = sin_phi + sin_alpha * dot(a_, b_);
  const float denominator = (k2 * sin_phi + k1 * cos_phi) * sin_alpha;
  const float cos_b =
      denominator != 0 ? std::clamp(((k2 * cos_phi - k1 * sin_phi) * cos_alpha - k2) / denominator, -1.0f, 1.0f) : 1.0f;
  const V3f c = a_ * cos_b + perpendicular_part(c_, a_) * safe_sqrt(1 - cos_b * cos_b);
  const float z = 1 - u.y * (1 - dot(c, b_));
  return normalize(b_ * z + perpendicular_part(c, b_) * safe_sqrt(1 - z * z));
}

}  // namespace helio
