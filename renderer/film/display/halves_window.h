// What the display layer reads of a window of the film, by planes: light of both halves over the surface's reflectance,
// its variance, and the first hits that guide the filter.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/film/core/film.h"

namespace helio {

inline PixelRect grown(const PixelRect& r, int by) {
  return {r.x0 - by, r.y0 - by, r.x1 + by, r.y1 + by};
}

// What light is divided by before it is filtered and multiplied with afterwards, so that filters blur light and not
// textures: the mean albedo of the pixel's first hits, at least 0.05; 1 where that is black, as the environment's is.
Rgb filter_reflectance(const PixelFeatures& features);

// Planes are row-major, all of `rect`, and kPlaneSlack longer, so that whole vectors can be read from any pixel.
// Outside the picture its edge is repeated. Radiance in units of the reader.
inline constexpr std::size_t kPlaneSlack = 16;

struct HalvesWindow {
  PixelRect rect;
  std::vector<float> light[kHalves][3];
  std::vector<float> variance;  // of a half's light, summed over the channels
  // What the pixel counts for where light is averaged: squared reflectance, with which the weighted mean of light is
  // the regression of radiance on reflectance; 0 outside the picture, and without samples.
  std::vector<float> weight;
  std::vector<float> albedo[3], normal[3];             // normals: unit, (1, 0, 0) for none
  std::vector<float> inverse_depth, slope_x, slope_y;  // 1 / distance, 0: no hit | its change to the next pixel
  // Beside what is filtered:
  std::vector<float> mean[3];        // radiance, both halves, as the picture has it
  std::vector<float> mean_variance;  // of that, summed over the channels

  std::size_t at(int x, int y) const {
    return std::size_t(y - rect.y0) * std::size_t(rect.width()) + std::size_t(x - rect.x0);
  }
  std::size_t plane_size() const { return std::size_t(rect.area()) + kPlaneSlack; }
};

// Reads a film in its own radiance times `scale`. Keeps its memory from window to window.
class HalvesReader {
 public:
  // roi: the picture; nothing beyond it is read.
  void begin(const Film& film, const PixelRect& roi, float scale) {
    film_ = &film;
    roi_ = roi;
    scale_ = scale;
  }

  // Each fills its planes of out.rect.
  //
  // Light is clamped: a half's pixel is at most twice as bright, as the picture has it, as the brightest of its eight
  // neighbours and of the nine pixels there of the other half. One sample in thousands that found a lamp by chance
  // would be a blot of the filter's size.
  void read_light(HalvesWindow& out);     // light, mean
  void read_variance(HalvesWindow& out);  // variance, mean_variance; after read_light() of the same rect
  void read_guides(HalvesWindow& out) const;  // weight, albedo, normal, inverse_depth, slopes

 private:
  void read_halves(const PixelRect& rect);
  void bound_variance(const PixelRect& rect);
  PixelRect clipped(const PixelRect& rect) const { return intersect(rect, roi_); }

  const Film* film_ = nullptr;
  PixelRect roi_;
  float scale_ = 1;
  // Of a window with a border; light of the halves, before it is clamped.
  std::vector<float> halves_[kHalves][3], brightness_[kHalves];
  std::vector<float> scales_[kHalves], pooled_[3], apart_, boxes_, bounds_;
};

}  // namespace helio
