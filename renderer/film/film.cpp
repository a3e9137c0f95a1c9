#include "renderer/film/film.h"

#include <algorithm>
#include <cassert>

namespace helio {

Film::Film(int width, int height) : width_(width), height_(height) {
  assert(width > 0 && height > 0);
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (std::vector<HalfPixel>& half : halves_) half.resize(pixels);
  features_.resize(pixels);
}

std::size_t Film::bytes() const {
  std::size_t total = features_.capacity() * sizeof(PixelFeatures);
  for (const std::vector<HalfPixel>& half : halves_) total += half.capacity() * sizeof(HalfPixel);
  return total;
}

void Film::clear() {
  for (std::vector<HalfPixel>& half : halves_) std::fill(half.begin(), half.end(), HalfPixel{});
  std::fill(features_.begin(), features_.end(), PixelFeatures{});
}

}  // namespace helio
