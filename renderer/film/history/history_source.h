// A picture that later ones can draw on: what a film knew when its camera left, in 68 bytes a pixel.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/history/film_history.h"

namespace helio {

// What a pixel said. Its numbers are packed so that noise hides what that takes (packed_values.h).
struct SourcePixel {
  static constexpr std::uint32_t kCountBits = 0xffffffu;
  static constexpr std::uint32_t kLookedUp = 1u << 30, kMixed = 1u << 31;

  // pack_count() of the inverse; above it the age's byte, and the lowest of the bias.
  std::uint32_t packed_count[kHalves] = {0, 0};
  // pack_short_numbers()
  std::uint32_t packed_spread[kHalves] = {0, 0};
  std::uint32_t packed_structure = 0;  // and above it flags
  PackedMeans means;              // of a half that knows nothing: the other's
  std::uint16_t packed_bias = 0;  // the upper 16 bits of pack_count()

  // 1 / effective samples of a half. 0: the half knows nothing.
  float inverse_count(int h) const { return unpack_count(packed_count[h] & kCountBits); }
  bool known(int h) const { return (packed_count[h] & kCountBits) != 0; }
  bool empty() const { return !known(0) && !known(1); }

  // Moves, as CarriedPixel::age.
  float age() const { return std::bit_cast<RootByte>(std::uint8_t(packed_count[0] >> 24)); }
  // CarriedPixel::bias2 as far as it is still in the means.
  float bias2() const { return unpack_count(std::uint32_t(packed_bias) << 8 | packed_count[1] >> 24); }

  void set_counts(const float (&inverse)[kHalves], float age) {
    packed_count[0] = pack_count(inverse[0]) | std::uint32_t(std::bit_cast<std::uint8_t>(RootByte(age))) << 24;
    packed_count[1] = pack_count(inverse[1]) | (packed_count[1] & ~kCountBits);
  }
  void set_bias2(float bias2) {
    const std::uint32_t packed = pack_count(bias2);
    packed_bias = std::uint16_t(packed >> 8);
    packed_count[1] = (packed_count[1] & kCountBits) | packed << 24;
  }

  // Variance of one sample of a half, per channel.
  Rgb spread(int h) const {
    const std::uint32_t packed = packed_spread[h];
    return {unpack_short_number(packed, 0), unpack_short_number(packed, 1), unpack_short_number(packed, 2)};
  }
  void set_spread(int h, const Rgb& spread) { packed_spread[h] = pack_short_numbers(spread.x, spread.y, spread.z); }

  // Squared differences of the picture over its albedo between neighbours, 3x3 mean, mean over the channels, noise
  // taken out (the product of the halves' differences). Second differences along x and y, and first differences: what
  // looking the picture up between its pixels, or next to them, may cost. Only of neighbours that lie inside a surface.
  float bend2(int axis) const { return unpack_short_number(packed_structure, axis); }
  float slope2() const { return unpack_short_number(packed_structure, 2); }
  void set_structure(float bend2_x, float bend2_y, float slope2) {
    packed_structure = pack_short_numbers(bend2_x, bend2_y, slope2) | (packed_structure & (kLookedUp | kMixed));
  }

  // Something that centres do not tell of shows in it, too: CarriedPixel::mixed() of what is no border.
  bool mixed() const { return (packed_structure & kMixed) != 0; }
  void note_mixed() { packed_structure |= kMixed; }
  // CarriedPixel::looked_up(), as far as something of that is left.
  bool looked_up() const { return (packed_structure & kLookedUp) != 0; }
  void note_looked_up() { packed_structure |= kLookedUp; }
};

// What radiance is divided by for a lookup, so that textures do not count as differences: the albedo, but 1 where it is
// too dark to divide by.
inline Rgb demodulation(const Rgb& albedo) {
  constexpr float kDark = 0.02f;
  const auto channel = [](float x) { return x >= kDark ? x : 1.0f; };
  return {channel(albedo.x), channel(albedo.y), channel(albedo.z)};
}

class HistorySource {
  struct Pixel {
    SourcePixel values;
    CentreHit centre;
    DirectionReservoir directions;
  };

 public:
  static constexpr std::size_t kBytesPerPixel = sizeof(Pixel);

  HistorySource(int width, int height)
      : width_(width), height_(height), pixels_(std::size_t(width) * std::size_t(height)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  const SourcePixel& pixel(int x, int y) const { return pixels_[index(x, y)].values; }
  SourcePixel& pixel(int x, int y) { return pixels_[index(x, y)].values; }
  const CentreHit& centre(int x, int y) const { return pixels_[index(x, y)].centre; }
  const DirectionReservoir& directions(int x, int y) const { return pixels_[index(x, y)].directions; }

  // Takes over a window of the film, whose history it has; reads up to two pixels beyond it, inside `region`. What lies
  // outside the region stays as it was, of whatever picture. Thread
  // safe for disjoint windows.
  void gather(const Film& film, const PixelRect& window, const PixelRect& region);
  std::size_t bytes() const { return pixels_.capacity() * sizeof(Pixel); }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, height_;
  std::vector<Pixel> pixels_;
};
static_assert(HistorySource::kBytesPerPixel == 68);

}  // namespace helio
