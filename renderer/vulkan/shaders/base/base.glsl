// Extensions, constants and small functions that every shader uses: renderer/base/math.h in GLSL.
#ifndef BASE_GLSL
#define BASE_GLSL

#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int16 : enable
#extension GL_EXT_shader_explicit_arithmetic_types_int8 : enable
#extension GL_EXT_control_flow_attributes : enable

const float kPi = 3.14159265358979323846;
const float kInvPi = 0.31830988618379067154;
const float kTwoPi = 2 * kPi;
const float kOneMinusEpsilon = 0.99999994;
#define kInfinity uintBitsToFloat(0x7f800000u)
#define kNotANumber uintBitsToFloat(0x7fc00000u)
const float kLargestFloat = 3.40282346638528859812e38;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Floats {
  float at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec2s {
  vec2 at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec3s {
  vec3 at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec4s {
  vec4 at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Uints {
  uint at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Doubles {
  double at[];
};

// Tells NaN and infinity by their bits: compilers of shaders may assume that there are none.
bool is_finite(float x) {
  return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}
bool is_finite(vec3 v) {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

float sqr(float x) {
  return x * x;
}
float safe_sqrt(float x) {
  return sqrt(max(0.0, x));
}
float length_squared(vec3 v) {
  return dot(v, v);
}
float luminance(vec3 c) {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}
float max_component(vec3 c) {
  return max(c.x, max(c.y, c.z));
}
bool is_black(vec3 c) {
  return c.x == 0 && c.y == 0 && c.z == 0;
}
bool normalizable(vec3 v) {
  const float squared = length_squared(v);
  return squared > 1e-30 && squared < 1e30;
}
float copysign(float magnitude, float sign_of) {
  return uintBitsToFloat((floatBitsToUint(magnitude) & 0x7fffffffu) | (floatBitsToUint(sign_of) & 0x80000000u));
}
// v at length 1; zero stays zero.
vec3 normalize_any(vec3 v) {
  const float squared = length_squared(v);
  if (squared >= 1e-30 && squared <= 1e30) return v * (1.0 / sqrt(squared));
  const dvec3 d = dvec3(v);
  const double l = sqrt(dot(d, d));
  return l > 0 ? vec3(d / l) : vec3(0);
}

#endif
