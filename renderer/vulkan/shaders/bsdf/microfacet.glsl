// Microfacet normals: trace/bsdf/microfacet.h and bsdf_microfacet.h, which cite the sources.
#ifndef MICROFACET_GLSL
#define MICROFACET_GLSL

#include "base/circle.glsl"
#include "base/error_function.glsl"
#include "scene/surface_params.glsl"

const float kDeltaAlpha = 1e-3;
const float kInvSqrtPi = 0.56418958354775628695;

struct Microfacet {
  uint distribution;
  float alpha;
  float alpha_along, alpha_across;  // anisotropic distributions; `alpha` then only looks albedos up
  vec2 along;
};

bool is_anisotropic(uint distribution) {
  return has_feature(kFeatureAnisotropy) &&
         (distribution == kGgxAnisotropic || distribution == kBeckmannAnisotropic);
}
bool is_beckmann(uint distribution) {
  return has_feature(kFeatureBeckmann) && (distribution == kBeckmann || distribution == kBeckmannAnisotropic);
}

// The facets of a material; alpha 0 stands for a mirror without facets. Isotropic distributions get both alphas, so
// that one formula serves all.
Microfacet microfacet_of(LobeParams params) {
  Microfacet facets;
  facets.distribution = params.distribution;
  facets.alpha = params.alpha < kDeltaAlpha ? 0.0 : params.alpha;
  if (is_anisotropic(params.distribution)) {
    facets.alpha_along = max(params.alpha_along, kDeltaAlpha);
    facets.alpha_across = max(params.alpha_across, kDeltaAlpha);
    facets.along = params.along;
  } else {
    facets.alpha_along = facets.alpha;
    facets.alpha_across = facets.alpha;
    facets.along = vec2(1, 0);
  }
  return facets;
}

float sin2_of(vec3 w) {
  return w.x * w.x + w.y * w.y;
}

// w in the frame whose x axis is `along`.
vec3 turned_to(vec3 w, vec2 along) {
  return vec3(along.x * w.x + along.y * w.y, along.x * w.y - along.y * w.x, w.z);
}

// D(m) per unit solid angle. 0 for m.z <= 0.
float normal_density(Microfacet facets, vec3 m) {
  if (!(m.z > 0)) return 0;
  const float a2 = facets.alpha * facets.alpha, cos2 = m.z * m.z, sin2 = sin2_of(m);
  const bool beckmann = is_beckmann(facets.distribution);
  if (!is_anisotropic(facets.distribution) && !beckmann) return a2 * kInvPi / sqr(a2 * cos2 + sin2);
  const vec3 t = turned_to(m, facets.along);
  const float product = facets.alpha_along * facets.alpha_across;
  const float stretched = sqr(t.x / facets.alpha_along) + sqr(t.y / facets.alpha_across);
  if (!beckmann) return kInvPi / (product * sqr(stretched + cos2));
  // Beyond e^-87 a float has nothing left.
  const float exponent = stretched / cos2;
  return exponent < 87 ? exp(-exponent) * kInvPi / (product * cos2 * cos2) : 0.0;
}

// sigma(w) in (0, 1].
float projected_area(Microfacet facets, vec3 w) {
  const vec3 t = turned_to(w, facets.along);
  const float spread2 = sqr(facets.alpha_along * t.x) + sqr(facets.alpha_across * t.y);
  if (!is_beckmann(facets.distribution)) return 0.5 * (w.z + sqrt(spread2 + w.z * w.z));
  if (!(spread2 > 0)) return w.z;
  const float spread = sqrt(spread2), a = w.z / spread;
  return 0.5 * (w.z * (1 + error_function(a)) + spread * kInvSqrtPi * exp(-a * a));
}

// Smith's G1(w) in [0, 1].
float masking(Microfacet facets, vec3 w) {
  return w.z > 0 ? min(1.0, w.z / projected_area(facets, w)) : 0.0;
}

// A visible normal of a GGX distribution, by spherical caps (Dupuy and Benyoub 2023).
vec3 sample_visible_ggx(vec3 wo, float alpha_x, float alpha_y, vec2 u) {
  const vec3 stretched = vec3(alpha_x * wo.x, alpha_y * wo.y, wo.z);
  const vec3 w = stretched * (1 / sqrt(dot(stretched, stretched)));
  const float z_plus_w = (1 - u.y) * (1 + w.z);
  const float one_minus_z = u.y * (1 + w.z);
  const float one_plus_z = z_plus_w + sin2_of(w) / (1 + w.z);
  const vec2 at = unit_circle(u.x) * sqrt(one_minus_z * one_plus_z);
  const vec3 m = vec3(alpha_x * (at.x + w.x), alpha_y * (at.y + w.y), z_plus_w);
  return m * (1 / sqrt(dot(m, m)));
}

// Slope along the direction of incidence of facets with unit roughness that a direction sees (Jakob 2014): Newton
// steps, those that leave the bracket replaced by bisection.
float sample_visible_beckmann_slope(float cos_scaled, float sin_scaled, float u) {
  const float kEdge = 1.0 / 8388608;
  u = clamp(u, kEdge, 1 - kEdge);
  const float largest = max(cos_scaled, sin_scaled);
  const float a = cos_scaled / largest, b = sin_scaled / largest;
  const bool slanted = b > 0;  // not along the normal, where the cotangent is infinite
  const float cot = slanted ? a / b : 0.0;
  const float x_max = slanted ? error_function(cot) : 1.0;
  const float whole = a * (1 + x_max) + (slanted ? b * kInvSqrtPi * exp(-cot * cot) : 0.0);
  const float target = u * whole, tolerance = 1e-6 * target;

  float low = -1, high = x_max;
  float x = x_max - (x_max + 1) * error_function(sqrt(-log(u)));
  for (int i = 0; i < 12; ++i) {
    if (!(x > low && x < high)) x = 0.5 * (low + high);
    const float slope = inverse_error_function(x);
    const float error = a * (1 + x) + b * kInvSqrtPi * exp(-slope * slope) - target;
    if (abs(error) <= tolerance) return slope;
    if (error > 0) high = x;
    else low = x;
    x -= error / (a - b * slope);
  }
  return inverse_error_function(clamp(x, low, high));
}

vec3 sample_visible_beckmann(vec3 wo, float alpha_x, float alpha_y, vec2 u) {
  const vec2 stretched = vec2(alpha_x * wo.x, alpha_y * wo.y);
  const float sine = sqrt(dot(stretched, stretched));
  const float along = sample_visible_beckmann_slope(wo.z, sine, u.x);
  const float across = inverse_error_function(2 * u.y - 1);
  const vec2 d = sine > 0 ? stretched / sine : vec2(1, 0);
  const vec3 m = vec3(-alpha_x * (d.x * along - d.y * across), -alpha_y * (d.y * along + d.x * across), 1);
  return m * (1 / sqrt(dot(m, m)));
}

// A normal with density D_wo(m).
vec3 sample_visible_normal(Microfacet facets, vec3 wo, vec2 u) {
  const vec3 w = turned_to(wo, facets.along);
  const vec3 m = is_beckmann(facets.distribution)
                     ? sample_visible_beckmann(w, facets.alpha_along, facets.alpha_across, u)
                     : sample_visible_ggx(w, facets.alpha_along, facets.alpha_across, u);
  return turned_to(m, vec2(facets.along.x, -facets.along.y));
}

#endif
