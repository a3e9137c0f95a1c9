// Directions that pixels remember of their light.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/direction_reservoir.h"

namespace helio::test {

inline std::uint32_t packed(const V3f& wi) {  // unit
  return pack_direction<DirectionReservoir::kAxisBits>(wi);
}

inline std::vector<std::uint32_t> directions_in(const DirectionReservoir& reservoir) {
  std::vector<std::uint32_t> all;
  for (int k = 0; k < DirectionReservoir::kPlaces; ++k) all.push_back(reservoir.direction(k));
  return all;
}

// In every other place the first one. share: DirectionReservoir::share().
inline DirectionReservoir in_turns(std::uint32_t first, std::uint32_t second, float share = 1) {
  DirectionReservoir reservoir;
  for (int k = 0; k < DirectionReservoir::kPlaces; ++k) reservoir.set_direction(k, k % 2 == 0 ? first : second);
  reservoir.set_share(share);
  return reservoir;
}

}  // namespace helio::test
