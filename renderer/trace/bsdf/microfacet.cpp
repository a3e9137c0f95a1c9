#include "renderer/trace/bsdf/microfacet.h"

#include <limits>
#include <numbers>

namespace helio {

namespace {

constexpr float kInvSqrtPi = std::numbers::inv_sqrtpi_v<float>;

float sin2_of(const V3f& w) {
  return w.x * w.x + w.y * w.y;
}

// Spherical caps (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"). The cap's sample has
// z = (1 - u.y) (1 + w.z) - w.z; z + w.z and 1 - z are formed without the subtraction.
V3f sample_visible_ggx(const V3f& wo, float alpha_x, float alpha_y, const V2f& u) {
  const V3f w = normalize(V3f(alpha_x * wo.x, alpha_y * wo.y, wo.z));
  const float z_plus_w = (1 - u.y) * (1 + w.z);
  const float one_minus_z = u.y * (1 + w.z);
  const float one_plus_z = z_plus_w + sin2_of(w) / (1 + w.z);
  const float radius = std::sqrt(one_minus_z * one_plus_z), phi = kTwoPi * u.x;
  return normalize(V3f(alpha_x * (radius * std::cos(phi) + w.x), alpha_y * (radius * std::sin(phi) + w.y), z_plus_w));
}

// Slope along the direction of incidence, of facets with unit roughness that a direction with cotangent `cot` sees:
// the distribution of Heitz and d'Eon 2014 inverted in the domain of the error function (Jakob 2014, "An Improved
// Visible Normal Sampling Routine for the Beckmann Distribution"), with x = erf(slope) in [-1, erf(cot)] and
//   cdf(x) ~ cot (1 + x) + exp(-slope^2) / sqrt(pi).
// The cumulative is concave and increasing; Newton steps that leave the bracket are replaced by bisection. Both terms
// are scaled so that cot may be 0 (grazing) or infinite (normal incidence).
float sample_visible_beckmann_slope(float cos_scaled, float sin_scaled, float u) {
  constexpr float kEdge = 0x1p-23f;
  constexpr int kMaxSteps = 12;
  u = std::clamp(u, kEdge, 1 - kEdge);
  const float largest = std::max(cos_scaled, sin_scaled);
  const float a = cos_scaled / largest, b = sin_scaled / largest;
  const float cot = b > 0 ? a / b : std::numeric_limits<float>::infinity();
  const float x_max = std::erf(cot);
  const auto cumulative = [&](float x, float slope) { return a * (1 + x) + b * kInvSqrtPi * std::exp(-slope * slope); };
  const float target = u * cumulative(x_max, cot);
  const float tolerance = 1e-6f * target;

  float low = -1, high = x_max;
  float x = x_max - (x_max + 1) * std::erf(std::sqrt(-std::log(u)));
  for (int step = 0; step < kMaxSteps; ++step) {
    if (!(x > low && x < high)) x = 0.5f * (low + high);
    const float slope = inverse_erf(x);
    const float error = cumulative(x, slope) - target;
    if (std::fabs(error) <= tolerance) return slope;
    (error > 0 ? high : low) = x;
    x -= error / (a - b * slope);
  }
  return inverse_erf(std::clamp(x, low, high));
}

V3f sample_visible_beckmann(const V3f& wo, float alpha, const V2f& u) {
  const float sine = std::sqrt(sin2_of(wo));
  const float along = sample_visible_beckmann_slope(wo.z, alpha * sine, u.x);
  const float across = inverse_erf(2 * u.y - 1);
  const float cos_phi = sine > 0 ? wo.x / sine : 1.0f, sin_phi = sine > 0 ? wo.y / sine : 0.0f;
  return normalize(
      V3f(-alpha * (cos_phi * along - sin_phi * across), -alpha * (sin_phi * along + cos_phi * across), 1.0f));
}

// Stretched by the roughnesses the microsurface is one of roughness 1, whose slopes are those here over alpha (Heitz
// and d'Eon 2014, section 3.2).
V3f sample_visible_beckmann(const V3f& wo, float alpha_x, float alpha_y, const V2f& u) {
  const float x = alpha_x * wo.x, y = alpha_y * wo.y, sine = std::sqrt(x * x + y * y);
  const float along = sample_visible_beckmann_slope(wo.z, sine, u.x);
  const float across = inverse_erf(2 * u.y - 1);
  const float cos_phi = sine > 0 ? x / sine : 1.0f, sin_phi = sine > 0 ? y / sine : 0.0f;
  return normalize(
      V3f(-alpha_x * (cos_phi * along - sin_phi * across), -alpha_y * (sin_phi * along + cos_phi * across), 1.0f));
}

// Into the frame whose x axis is `along`, and back.
V3f turned(const V3f& w, const V2f& along) {
  return {along.x * w.x + along.y * w.y, along.x * w.y - along.y * w.x, w.z};
}

}  // namespace

float inverse_erf(float x) {
  x = std::clamp(x, -1 + 0x1p-24f, 1 - 0x1p-24f);
  float w = -std::log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5f;
    p = 2.81022636e-08f;
    p = 3.43273939e-07f + p * w;
    p = -3.5233877e-06f + p * w;
    p = -4.39150654e-06f + p * w;
    p = 0.00021858087f + p * w;
    p = -0.00125372503f + p * w;
    p = -0.00417768164f + p * w;
    p = 0.246640727f + p * w;
    p = 1.50140941f + p * w;
  } else {
    w = std::sqrt(w) - 3;
    p = -0.000200214257f;
    p = 0.000100950558f + p * w;
    p = 0.00134934322f + p * w;
    p = -0.00367342844f + p * w;
    p = 0.00573950773f + p * w;
    p = -0.0076224613f + p * w;
    p = 0.00943887047f + p * w;
    p = 1.00167406f + p * w;
    p = 2.83297682f + p * w;
  }
  return p * x;
}

float Microfacet::normal_density(const V3f& m) const {
  if (!(m.z > 0)) return 0;
  const float a2 = alpha * alpha, cos2 = m.z * m.z, sin2 = sin2_of(m);
  if (distribution == MicrofacetDistribution::ggx) return a2 * kInvPi / sqr(a2 * cos2 + sin2);
  if (distribution == MicrofacetDistribution::ggx_anisotropic) {
    const V3f t = turned(m, along);
    return kInvPi / (alpha_along * alpha_across * sqr(sqr(t.x / alpha_along) + sqr(t.y / alpha_across) + cos2));
  }
  // exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4); beyond e^-87 a float has nothing left.
  if (distribution == MicrofacetDistribution::beckmann_anisotropic) {
    const V3f t = turned(m, along);
    const float exponent = (sqr(t.x / alpha_along) + sqr(t.y / alpha_across)) / cos2;
    return exponent < 87 ? std::exp(-exponent) * kInvPi / (alpha_along * alpha_across * cos2 * cos2) : 0.0f;
  }
  const float exponent = sin2 / (a2 * cos2);
  return exponent < 87 ? std::exp(-exponent) * kInvPi / (a2 * cos2 * cos2) : 0.0f;
}

float Microfacet::projected_area(const V3f& w) const {
  const float sin2 = sin2_of(w);
  if (distribution == MicrofacetDistribution::ggx) return 0.5f * (w.z + std::sqrt(alpha * alpha * sin2 + w.z * w.z));
  if (distribution == MicrofacetDistribution::ggx_anisotropic) {
    const V3f t = turned(w, along);
    return 0.5f * (w.z + std::sqrt(sqr(alpha_along * t.x) + sqr(alpha_across * t.y) + w.z * w.z));
  }
  float spread = alpha * std::sqrt(sin2);
  if (distribution == MicrofacetDistribution::beckmann_anisotropic) {
    const V3f t = turned(w, along);
    spread = std::sqrt(sqr(alpha_along * t.x) + sqr(alpha_across * t.y));
  }
  const float a = spread > 0 ? w.z / spread : std::numeric_limits<float>::infinity();
  return 0.5f * (w.z * (1 + std::erf(a)) + spread * kInvSqrtPi * std::exp(-a * a));
}

V3f Microfacet::sample_visible_normal(const V3f& wo, const V2f& u) const {
  if (distribution == MicrofacetDistribution::ggx) return sample_visible_ggx(wo, alpha, alpha, u);
  if (distribution == MicrofacetDistribution::beckmann) return sample_visible_beckmann(wo, alpha, u);
  const auto sample = distribution == MicrofacetDistribution::ggx_anisotropic
                          ? sample_visible_ggx
                          : static_cast<V3f (*)(const V3f&, float, float, const V2f&)>(sample_visible_beckmann);
  const V3f m = sample(turned(wo, along), alpha_along, alpha_across, u);
  return turned(m, V2f(along.x, -along.y));
}

}  // namespace helio
