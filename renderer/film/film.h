// Resident per-pixel state of one picture: two independent half buffers and the first-hit features.
//
// Each half has its own scramble of the Sobol sequence, so mean A and mean B are independent estimates of the same
// picture. Sums are double and samples are added one by one in index order by one worker per pixel, so the bits do not
// depend on how the work was cut.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

inline constexpr int kHalves = 2;

// One half of one pixel. count is the number of valid samples; invalid ones never enter.
struct HalfPixel {
  double sum[3] = {0, 0, 0};
  double sum_squares[3] = {0, 0, 0};
  std::uint32_t count = 0;
  std::uint32_t invalid = 0;

  void add(const Rgb& radiance) {
    for (int c = 0; c < 3; ++c) {
      const double x = radiance[c];
      sum[c] += x;
      sum_squares[c] += x * x;
    }
    ++count;
  }
};

// First-hit features. Means over the pixel's samples are not kept: these are those of the first sample of half A, which
// is what reprojection needs (one consistent surface point), except albedo and normal, which are running float sums.
struct PixelFeatures {
  float albedo[3] = {0, 0, 0};   // sum of the hemispherical reflectance of the first hit, environment: 0
  float normal[3] = {0, 0, 0};   // sum of world-space shading normals
  std::uint32_t count = 0;       // samples in the two sums
  float coverage = 0;            // sum of hits (1) and misses (0): alpha
  float depth = 0;               // distance along the first sample's ray to its hit, +inf: miss
  std::uint32_t instance = ~0u;  // of the first sample; ~0: miss
  std::uint32_t primitive = ~0u;
};

class Film {
 public:
  Film(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  PixelRect bounds() const { return {0, 0, width_, height_}; }
  std::size_t bytes() const;

  HalfPixel& half(int h, int x, int y) { return halves_[h][index(x, y)]; }
  const HalfPixel& half(int h, int x, int y) const { return halves_[h][index(x, y)]; }
  PixelFeatures& features(int x, int y) { return features_[index(x, y)]; }
  const PixelFeatures& features(int x, int y) const { return features_[index(x, y)]; }

  void clear();

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * width_ + x; }

  int width_, height_;
  std::vector<HalfPixel> halves_[kHalves];
  std::vector<PixelFeatures> features_;
};

}  // namespace helio
