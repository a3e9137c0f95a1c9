// Which parts of a picture get light paths: mode pt+bdpt decides it tile by tile before the first sample.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

// Side in pixels of the tiles, aligned to the film; a multiple of kFilmBlock.
inline constexpr int kLightTile = 32;

class LightTiles {
 public:
  // All tiles alike.
  LightTiles(int width, int height, bool on)
      : width_(width),
        height_(height),
        columns_((width + kLightTile - 1) / kLightTile),
        rows_((height + kLightTile - 1) / kLightTile),
        on_(std::size_t(columns_) * std::size_t(rows_), on) {}

  std::size_t size() const { return on_.size(); }
  PixelRect window(std::size_t tile) const {
    const int x = int(tile % std::size_t(columns_)) * kLightTile, y = int(tile / std::size_t(columns_)) * kLightTile;
    return {x, y, std::min(x + kLightTile, width_), std::min(y + kLightTile, height_)};
  }
  void set(std::size_t tile, bool on) { on_[tile] = on; }
  bool any() const {
    return std::any_of(on_.begin(), on_.end(), [](std::uint8_t on) { return on != 0; });
  }
  // Of a pixel of the film.
  bool on(int x, int y) const { return on_[at(x, y)] != 0; }
  std::size_t at(int x, int y) const {
    return std::size_t(y / kLightTile) * std::size_t(columns_) + std::size_t(x / kLightTile);
  }
  int columns() const { return columns_; }
  int width() const { return width_; }  // of the film
  int height() const { return height_; }
  // Pixels of a part of the film in tiles that are on.
  double pixels_in(const PixelRect& part) const {
    double sum = 0;
    for (std::size_t t = 0; t < on_.size(); ++t) {
      const PixelRect shared = intersect(window(t), part);
      if (on_[t] && !shared.empty()) sum += double(shared.area());
    }
    return sum;
  }

 private:
  int width_, height_, columns_, rows_;
  std::vector<std::uint8_t> on_;
};

}  // namespace helio
