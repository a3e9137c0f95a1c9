// Fresnel reflectance for unpolarised light, and refraction: trace/bsdf/fresnel.h, which derives the formulas.
#ifndef FRESNEL_GLSL
#define FRESNEL_GLSL

#include "base/base.glsl"

float schlick_term(float cos_i) {
  const float x = clamp(1 - cos_i, 0.0, 1.0), x2 = x * x;
  return x2 * x2 * x;
}

vec3 mean_schlick(vec3 f0) {
  return f0 + (vec3(1) - f0) * (1.0 / 21);
}

float dielectric_f0(float ior) {
  return sqr((ior - 1) / (ior + 1));
}

struct DielectricFresnel {
  float reflectance;  // 1 under total internal reflection
  float cos_t;        // of the refracted direction, >= 0; 0 under total internal reflection
};

DielectricFresnel fresnel_dielectric(float cos_i, float eta) {
  const float c = clamp(cos_i, 0.0, 1.0), c2 = c * c, eta2 = eta * eta;
  const float rise = (eta - 1) * (eta + 1);
  if (rise == 0) return DielectricFresnel(0, c);
  const float g2 = rise + c2;
  if (g2 < 0) return DielectricFresnel(1, 0);
  const float g = sqrt(g2);
  const float sum_s = c + g, sum_p = eta2 * c + g;
  const float r_s = -rise / sqr(sum_s);
  const float r_p = rise * ((eta2 + 1) * c2 - 1) / sqr(sum_p);
  return DielectricFresnel(min(1.0, 0.5 * (r_s * r_s + r_p * r_p)), g / eta);
}

// refract() of fresnel.h; GLSL has another function of that name.
vec3 refracted(vec3 w, vec3 m, float cos_i, float cos_t, float eta) {
  const float inverse = 1 / eta;
  return m * (cos_i * inverse - cos_t) - w * inverse;
}

float fresnel_conductor(float cos_i, float eta, float k) {
  const float c = clamp(cos_i, 0.0, 1.0), c2 = c * c, s2 = (1 - c) * (1 + c);
  const float real = (eta - k) * (eta + k) - s2, product = eta * k;
  const float a2b2 = sqrt(real * real + 4 * product * product);
  float a = safe_sqrt(0.5 * (a2b2 + abs(real)));
  if (real < 0) a = a > 0 ? product / a : 0.0;
  const float t1 = a2b2 + c2, t2 = 2 * a * c;
  if (!(t1 + t2 > 0)) return 0;  // index 1 at 90 degrees: no interface
  const float r_s = (t1 - t2) / (t1 + t2);
  const float t3 = c2 * a2b2 + s2 * s2, t4 = t2 * s2;
  const float r_p = t3 + t4 > 0 ? r_s * (t3 - t4) / (t3 + t4) : r_s;
  return clamp(0.5 * (r_s + r_p), 0.0, 1.0);
}

vec3 fresnel_conductor(float cos_i, vec3 eta, vec3 k) {
  return vec3(fresnel_conductor(cos_i, eta.x, k.x), fresnel_conductor(cos_i, eta.y, k.y),
              fresnel_conductor(cos_i, eta.z, k.z));
}

#endif
