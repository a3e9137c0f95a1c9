// Balance of two techniques by the power heuristic with exponent 2 (Veach 1997, eq. 9.13): trace/sampling/mis.h.
#ifndef MIS_GLSL
#define MIS_GLSL

float mis_weight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1 / (1 + ratio * ratio);
}

#endif
