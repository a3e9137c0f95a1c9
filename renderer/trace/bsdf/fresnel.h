// Fresnel reflectance for unpolarised light, and refraction. Cosines are of the angle to the (micro)normal on the side
// of the given direction, in [0, 1]; every function is finite over its whole domain.
#pragma once

#include "renderer/base/math.h"

namespace helio {

// (1 - cos)^5: the angular part of Schlick's approximation (Schlick 1994), F = f0 + (f90 - f0) * schlick_term.
inline float schlick_term(float cos_i) {
  const float x = std::clamp(1 - cos_i, 0.0f, 1.0f), x2 = x * x;
  return x2 * x2 * x;
}

// Mean of f0 + (1 - f0) schlick_term over the hemisphere, weighed by the cosine.
inline Rgb mean_schlick(const Rgb& f0) {
  return f0 + (Rgb(1) - f0) * (1.0f / 21);
}

// Reflectance at normal incidence of a dielectric; ior 0 and infinity give 1.
inline float dielectric_f0(float ior) {
  return sqr((ior - 1) / (ior + 1));
}

struct DielectricFresnel {
  float reflectance = 1;  // 1 under total internal reflection
  float cos_t = 0;        // of the refracted direction, >= 0; 0 under total internal reflection
};

// Exact equations for an interface with relative index eta > 0 = index on the far side / index on the side of cos_i.
// With g = eta cos_t = sqrt(eta^2 - 1 + cos_i^2) the amplitudes are
//   r_s = (c - g) / (c + g)                 = -(eta^2 - 1) / (c + g)^2
//   r_p = (eta^2 c - g) / (eta^2 c + g)     = (eta^2 - 1) ((eta^2 + 1) c^2 - 1) / (eta^2 c + g)^2,
// whose right-hand forms do not cancel for eta near 1.
inline DielectricFresnel fresnel_dielectric(float cos_i, float eta) {
  const float c = std::clamp(cos_i, 0.0f, 1.0f), c2 = c * c, eta2 = eta * eta;
  const float step = (eta - 1) * (eta + 1);
  if (step == 0) return {0, c};
  const float g2 = step + c2;
  if (g2 < 0) return {};
  const float g = std::sqrt(g2);
  const float sum_s = c + g, sum_p = eta2 * c + g;
  const float r_s = -step / sqr(sum_s);
  const float r_p = step * ((eta2 + 1) * c2 - 1) / sqr(sum_p);
  return {std::min(1.0f, 0.5f * (r_s * r_s + r_p * r_p)), g / eta};
}

// Direction of the refracted ray, pointing away from the surface on the far side of m. `cos_i` = dot(w, m) > 0,
// `cos_t` and `eta` as above.
inline V3f refract(const V3f& w, const V3f& m, float cos_i, float cos_t, float eta) {
  const float inverse = 1 / eta;
  return m * (cos_i * inverse - cos_t) - w * inverse;
}

// Exact equations for one channel of a conductor with complex index eta + i k, from a vacuum (Born and Wolf 14.2).
// With (a + i b)^2 = eta^2 - k^2 - sin^2 + 2 i eta k the smaller of a and b comes from a b = eta k, which does not
// cancel for strong metals.
inline float fresnel_conductor(float cos_i, float eta, float k) {
  const float c = std::clamp(cos_i, 0.0f, 1.0f), c2 = c * c, s2 = (1 - c) * (1 + c);
  const float real = (eta - k) * (eta + k) - s2, product = eta * k;
  const float a2b2 = std::hypot(real, 2 * product);
  float a = std::sqrt(std::max(0.0f, 0.5f * (a2b2 + std::fabs(real))));
  if (real < 0) a = a > 0 ? product / a : 0.0f;
  const float t1 = a2b2 + c2, t2 = 2 * a * c;
  if (!(t1 + t2 > 0)) return 0;  // index 1 at 90 degrees: no interface
  const float r_s = (t1 - t2) / (t1 + t2);
  const float t3 = c2 * a2b2 + s2 * s2, t4 = t2 * s2;
  const float r_p = t3 + t4 > 0 ? r_s * (t3 - t4) / (t3 + t4) : r_s;
  return std::clamp(0.5f * (r_s + r_p), 0.0f, 1.0f);
}

inline Rgb fresnel_conductor(float cos_i, const Rgb& eta, const Rgb& k) {
  return {fresnel_conductor(cos_i, eta.x, k.x), fresnel_conductor(cos_i, eta.y, k.y),
          fresnel_conductor(cos_i, eta.z, k.z)};
}

}  // namespace helio
