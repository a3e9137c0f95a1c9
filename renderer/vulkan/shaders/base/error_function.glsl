// The error function, which GLSL lacks, and its inverse (trace/bsdf/microfacet.cpp).
#ifndef ERROR_FUNCTION_GLSL
#define ERROR_FUNCTION_GLSL

#include "base/base.glsl"

// erf(x) for x >= 0. Chebyshev fits: of erf(x) / x in x^2 up to 1, relative error 3e-11 before rounding, and of
// erfc(x) exp(x^2) in 1 / x up to 4, absolute error of the result 2e-8.
float error_function(float x) {
  if (x < 1) {
    const float t = x * x;
    float p = -9.667044571e-6;
    p = 0.0001126595903 + p * t;
    p = -0.0008484080406 + p * t;
    p = 0.005221031808 + p * t;
    p = -0.02686543073 + p * t;
    p = 0.112837825 + p * t;
    p = -0.3761263847 + p * t;
    p = 1.128379167 + p * t;
    return x * p;
  }
  if (!(x < 4)) return 1;
  const float t = 1 / x;
  float p = -0.01960502937;
  p = 0.1284794506 + p * t;
  p = -0.3685625586 + p * t;
  p = 0.589897173 + p * t;
  p = -0.5138991224 + p * t;
  p = 0.05359949362 + p * t;
  p = 0.557292635 + p * t;
  p = 0.0003815322944 + p * t;
  return 1 - p * exp(-x * x);
}

// The inverse of the error function in single precision (Giles 2012). Values outside of (-1, 1) are clamped into it.
float inverse_error_function(float x) {
  const float kLargest = 1 - 1.0 / 16777216;
  x = clamp(x, -kLargest, kLargest);
  float w = -log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5;
    p = 2.81022636e-08;
    p = 3.43273939e-07 + p * w;
    p = -3.5233877e-06 + p * w;
    p = -4.39150654e-06 + p * w;
    p = 0.00021858087 + p * w;
    p = -0.00125372503 + p * w;
    p = -0.00417768164 + p * w;
    p = 0.246640727 + p * w;
    p = 1.50140941 + p * w;
  } else {
    w = sqrt(w) - 3;
    p = -0.000200214257;
    p = 0.000100950558 + p * w;
    p = 0.00134934322 + p * w;
    p = -0.00367342844 + p * w;
    p = 0.00573950773 + p * w;
    p = -0.0076224613 + p * w;
    p = 0.00943887047 + p * w;
    p = 1.00167406 + p * w;
    p = 2.83297682 + p * w;
  }
  return p * x;
}

#endif
