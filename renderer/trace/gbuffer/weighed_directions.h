// Directions that light of pixels came from, with what they bring, and which of them a new pixel remembers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "renderer/base/check.h"
#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/core/film.h"

namespace helio {

// A direction of a DirectionReservoir, as it is coded there.
struct WeighedDirection {
  std::uint32_t packed = 0;
  float weight = 0;  // luminance by which it counts (DirectionReservoir::counting()), [0, FLT_MAX]
};

// Of the four pixels of a lookup, where all are asked.
inline constexpr std::size_t kMostWeighed = 4 * kHalves * DirectionReservoir::kPlaces;

struct WeighedDirections {
  WeighedDirection of[kMostWeighed];
  std::size_t count = 0;
  double light = 0;  // luminance of what the directions stand for

  // All that a pixel remembers of a half, for light of that luminance.
  void add(const DirectionReservoir& reservoir, int half, float brought) {
    HELIO_DCHECK(count + DirectionReservoir::kPlaces <= kMostWeighed);
    const float weight = brought / DirectionReservoir::kPlaces * DirectionReservoir::counting(reservoir.share(half));
    for (int k = 0; k < DirectionReservoir::kPlaces; ++k) of[count++] = {reservoir.direction(half, k), weight};
    light += double(brought);
  }
  // A direction that was kept more than once knows no more than once.
  void merge_equal();

  std::span<const WeighedDirection> all() const { return {of, count}; }
};

// Fills all places, each as likely with one of `among` as that weighs, whatever half it was of: halves share what
// directions tell; and the share that weights and light come to. Systematic sampling: what weighs as much as a place is
// in it. With no weight at all there is nothing.
void pick_directions(std::span<const WeighedDirections* const> among, std::uint32_t key, DirectionReservoir& out);

}  // namespace helio
