// What evaluating and sampling a BSDF give: BsdfValue and BsdfSample of trace/bsdf/bsdf.h.
#ifndef BSDF_VALUES_GLSL
#define BSDF_VALUES_GLSL

#include "base/base.glsl"

struct BsdfValue {
  vec3 f_cos;   // f(wo, wi) |cos wi|, deltas excluded
  float pdf_w;  // density with which sample_bsdf picks wi given that it may pick any lobe, deltas excluded
};

struct BsdfSample {
  vec3 wi;
  vec3 weight;  // f |cos| / pdf for the chosen technique
  float pdf_w;  // solid angle density of the whole non-delta mixture at wi; probability of the lobe for deltas; 0: none
  float eta;    // 1, or the relative ior crossed
  bool delta;
  bool transmitted;
};

BsdfValue no_value() {
  return BsdfValue(vec3(0), 0);
}
BsdfSample no_sample() {
  return BsdfSample(vec3(0), vec3(0), 0, 1, false, false);
}

// The sample that a direction makes whose value and density are known; none where the density is 0 or not finite.
BsdfSample sample_of(vec3 wi, BsdfValue value) {
  if (!(value.pdf_w > 0) || !is_finite(value.pdf_w)) return no_sample();
  return BsdfSample(wi, value.f_cos / value.pdf_w, value.pdf_w, 1, false, false);
}

#endif
