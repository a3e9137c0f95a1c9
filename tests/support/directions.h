// Directions that pixels remember of their light.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/core/film.h"

namespace helio::test {

inline std::uint32_t packed(const V3f& wi) {  // unit
  return pack_direction<DirectionReservoir::kAxisBits>(wi);
}

// Of both halves, all places.
inline std::vector<std::uint32_t> directions_in(const DirectionReservoir& reservoir) {
  std::vector<std::uint32_t> all;
  for (int h = 0; h < kHalves; ++h) {
    for (int k = 0; k < DirectionReservoir::kPlaces; ++k) all.push_back(reservoir.direction(h, k));
  }
  return all;
}

// share: DirectionReservoir::share() of both.
inline DirectionReservoir in_each_half(std::uint32_t first, std::uint32_t second, float share = 1) {
  DirectionReservoir reservoir;
  for (int h = 0; h < kHalves; ++h) {
    reservoir.set_direction(h, 0, first);
    reservoir.set_direction(h, 1, second);
    reservoir.set_share(h, share);
  }
  return reservoir;
}

}  // namespace helio::test
