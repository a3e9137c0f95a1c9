// A picture that later ones can draw on: what a film knew when its camera left, in 68 bytes a pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/film.h"
#include "renderer/film/film_history.h"

namespace helio {

struct SourcePixel {
  float mean[kHalves][3] = {};
  // Effective samples of each half: the smaller of theirs. 0: the pixel knows nothing, or may show two surfaces.
  float count = 0;
  float bias2 = 0;  // CarriedPixel::bias2 as far as it is still in the means
  // Variance of one sample, per half and channel: pack_short_float().
  std::uint16_t spread[kHalves][3] = {};
  // Squared differences of the picture over its albedo between neighbours, 3x3 mean, mean over the channels, noise
  // taken out (the product of the halves' differences): pack_short_float(). Second differences along x and y, and
  // first differences: what looking the picture up between its pixels, or next to them, may cost. Only of neighbours
  // that lie inside a surface.
  std::uint16_t bend2[2] = {};
  std::uint16_t slope2 = 0;
  std::uint8_t age = 0;  // moves, as CarriedPixel::age
};

// Whether neighbouring pixels show one surface: both leave the scene, or their centres meet the same instance under
// normals less than 37 degrees apart.
bool same_surface(const CentreHit& a, const CentreHit& b);
// Whether some pixel next to (x, y), inside the region, shows another one.
bool on_border(const FilmHistory& history, int x, int y, const PixelRect& region);

// What radiance is divided by for a lookup, so that textures do not count as differences: the albedo, but 1 where it is
// too dark to divide by.
inline Rgb demodulation(const Rgb& albedo) {
  constexpr float kDark = 0.02f;
  const auto channel = [](float x) { return x >= kDark ? x : 1.0f; };
  return {channel(albedo.x), channel(albedo.y), channel(albedo.z)};
}

class HistorySource {
 public:
  static constexpr std::size_t kBytesPerPixel = sizeof(SourcePixel) + sizeof(CentreHit);

  HistorySource(int width, int height)
      : width_(width), height_(height), pixels_(std::size_t(width) * std::size_t(height)), centres_(pixels_.size()) {}

  int width() const { return width_; }
  int height() const { return height_; }
  const SourcePixel& pixel(int x, int y) const { return pixels_[index(x, y)]; }
  const CentreHit& centre(int x, int y) const { return centres_[index(x, y)]; }

  // Takes over a window of the film, whose history it has; reads up to two pixels beyond it, inside `region`. Thread
  // safe for disjoint windows.
  void gather(const Film& film, const PixelRect& window, const PixelRect& region);
  // Pixels outside the region know nothing.
  void clear() { std::fill(pixels_.begin(), pixels_.end(), SourcePixel{}); }

  std::size_t bytes() const {
    return pixels_.capacity() * sizeof(SourcePixel) + centres_.capacity() * sizeof(CentreHit);
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, height_;
  std::vector<SourcePixel> pixels_;
  std::vector<CentreHit> centres_;
};

}  // namespace helio
