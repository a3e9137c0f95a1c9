// A picture that later ones can draw on: what a film knew when its camera left, in 88 bytes a pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/film.h"
#include "renderer/film/film_history.h"

namespace helio {

// In lanes of eight, as lookups add them up.
struct SourcePixel {
  float mean[kHalves][3] = {};
  // 1 / effective samples of each half. 0: the half knows nothing.
  float inverse_count[kHalves] = {0, 0};
  // All of these: pack_short_float(). Variance of one sample, per half and channel.
  std::uint16_t spread[kHalves][3] = {};
  // Squared differences of the picture over its albedo between neighbours, 3x3 mean, mean over the channels, noise
  // taken out (the product of the halves' differences). Second differences along x and y, and first differences: what
  // looking the picture up between its pixels, or next to them, may cost. Only of neighbours that lie inside a surface.
  std::uint16_t bend2[2] = {};
  std::uint16_t slope2 = 0;
  std::uint16_t age = 0;  // moves, as CarriedPixel::age
  float bias2 = 0;        // CarriedPixel::bias2 as far as it is still in the means

  bool known(int h) const { return inverse_count[h] > 0; }
  bool empty() const { return inverse_count[0] == 0 && inverse_count[1] == 0; }
};

// What radiance is divided by for a lookup, so that textures do not count as differences: the albedo, but 1 where it is
// too dark to divide by.
inline Rgb demodulation(const Rgb& albedo) {
  constexpr float kDark = 0.02f;
  const auto channel = [](float x) { return x >= kDark ? x : 1.0f; };
  return {channel(albedo.x), channel(albedo.y), channel(albedo.z)};
}

class HistorySource {
 public:
  static constexpr std::size_t kBytesPerPixel = sizeof(SourcePixel) + sizeof(CentreHit) + sizeof(DirectionReservoir);

  HistorySource(int width, int height)
      : width_(width),
        height_(height),
        pixels_(std::size_t(width) * std::size_t(height)),
        centres_(pixels_.size()),
        directions_(pixels_.size()) {}

  int width() const { return width_; }
  int height() const { return height_; }
  const SourcePixel& pixel(int x, int y) const { return pixels_[index(x, y)]; }
  SourcePixel& pixel(int x, int y) { return pixels_[index(x, y)]; }
  const CentreHit& centre(int x, int y) const { return centres_[index(x, y)]; }
  const DirectionReservoir& directions(int x, int y) const { return directions_[index(x, y)]; }

  // Takes over a window of the film, whose history it has; reads up to two pixels beyond it, inside `region`. What lies
  // outside the region stays as it was, of whatever picture. Thread
  // safe for disjoint windows.
  void gather(const Film& film, const PixelRect& window, const PixelRect& region);
  std::size_t bytes() const {
    return pixels_.capacity() * sizeof(SourcePixel) + centres_.capacity() * sizeof(CentreHit) +
           directions_.capacity() * sizeof(DirectionReservoir);
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, height_;
  std::vector<SourcePixel> pixels_;
  std::vector<CentreHit> centres_;
  std::vector<DirectionReservoir> directions_;
};

}  // namespace helio
