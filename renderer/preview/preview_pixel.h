// What a preview keeps of a pixel, and how it is packed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "renderer/base/half_float.h"
#include "renderer/base/math.h"

namespace helio {

// A surface's colour by roots in bytes. Never darker than 0.02, so that light can be had by dividing.
inline std::uint32_t pack_color(const Rgb& color) {
  std::uint32_t packed = 0;
  for (int c = 0; c < 3; ++c) {
    const float root = std::sqrt(std::min(std::max(color[c], 0.02f), 1.0f));
    packed |= std::uint32_t(root * 255 + 0.5f) << (8 * c);
  }
  return packed;
}
inline Rgb unpack_color(std::uint32_t packed) {
  const auto channel = [packed](int c) {
    const float root = float(packed >> (8 * c) & 255u) * (1.0f / 255);
    return root * root;
  };
  return {channel(0), channel(1), channel(2)};
}
inline constexpr std::uint32_t kWhite = 0xffffffu;

// Samples of a pixel whose light is known exactly: lamps and the environment, seen directly.
inline constexpr std::uint8_t kExactSamples = 127;

// What the ray through a pixel's centre meets, and the light that it sends with the surface's colour divided out.
struct PreviewPixel {
  float depth = 0;                    // along the view axis, scene units; +inf: nothing was met
  std::uint16_t surface = 0;          // of object and material; 0: nothing was met
  std::uint16_t light[3] = {0, 0, 0};  // pack_half()
  std::int8_t normal[3] = {0, 0, 0};  // geometric, towards the viewer, in 127ths
  std::uint8_t samples : 7 = 0;       // path samples in the light; 0: it was filled in from neighbours
  std::uint8_t lit : 1 = 0;           // something is known of the light, be it black

  bool hit() const { return surface != 0; }
  // At most kExactSamples - 1 are noted.
  void set_samples(float count) { samples = std::uint8_t(std::min(count, float(kExactSamples - 1))) & kExactSamples; }
  Rgb unpacked_light() const { return {unpack_half(light[0]), unpack_half(light[1]), unpack_half(light[2])}; }
  void set_light(const Rgb& value) {
    for (int c = 0; c < 3; ++c) light[c] = pack_half(value[c]);
    lit = 1;
  }
  V3f unpacked_normal() const {
    return V3f(float(normal[0]), float(normal[1]), float(normal[2])) * (1.0f / 127);
  }
  void set_normal(const V3f& n) {
    for (int c = 0; c < 3; ++c) normal[c] = std::int8_t(std::lrint(std::clamp(n[c], -1.0f, 1.0f) * 127));
  }
};
static_assert(sizeof(PreviewPixel) == 16 && offsetof(PreviewPixel, surface) == 4 && offsetof(PreviewPixel, normal) == 12,
              "preview_taps.h reads it as four words");

// How far off the depth of a point of the same surface may be, of the depth: what floats, packed normals and curvature
// explain.
inline constexpr float kDepthSlack = 0.004f;

// Cosine of the angle by which the normals of two pixels of one surface may differ at most, of normals in 127ths: some 37
// degrees.
inline constexpr int kLeastCosine = int(0.8f * 127 * 127);

// Whether `tap` shows the surface of `pixel`, which is expected at `depth` there, give or take `slack`: one object and
// material, and like normals.
inline bool same_surface(const PreviewPixel& tap, const PreviewPixel& pixel, float depth, float slack) {
  return tap.surface == pixel.surface && std::fabs(tap.depth - depth) <= slack &&
         int(tap.normal[0]) * pixel.normal[0] + int(tap.normal[1]) * pixel.normal[1] +
                 int(tap.normal[2]) * pixel.normal[2] >
             kLeastCosine;
}

}  // namespace helio
