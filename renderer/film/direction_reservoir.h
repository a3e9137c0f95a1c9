// Where the light of a pixel comes from at its first hit: directions of a few of its samples, by which a later picture
// that sees the surface from elsewhere weighs what the samples said (trace/centre_hits.h).
#pragma once

#include <cstdint>

#include "renderer/film/film.h"
#include "renderer/film/packed_values.h"

namespace helio {

// Each place of a half holds the direction of one of its samples, picked with a probability proportional to the
// sample's luminance, whatever the number of samples: weighted reservoir sampling (Chao 1982) with replacement, a place
// at a time. Pictures that draw on earlier ones begin with directions of either half and of neighbours there
// (pick_directions()).
struct DirectionReservoir {
  static constexpr int kPlaces = 2;
  static constexpr int kAxisBits = 12;  // a hundredth of a lobe of alpha 0.1
  // Beside pack_direction<kAxisBits>()'s codes, of which these are none that it gives but for rounding.
  static constexpr std::uint32_t kNone = 0;      // nothing is known, or no direction: a delta lobe
  static constexpr std::uint32_t kAny = 0xfffu;  // what the surface emits: the same from everywhere

  Packed24 place[kHalves][kPlaces] = {};

  // Splats are not among these: they leave directions of their own (film/splat_buffer.h).

  // A sample of luminance `brought` >= 0; whole: that of all samples of the half, this one among them. u: uniform in
  // [0, 1), independent of the sample.
  void add(int half, std::uint32_t direction, float brought, double whole, const float (&u)[kPlaces]) {
    for (int k = 0; k < kPlaces; ++k) {
      if (double(u[k]) * whole < double(brought)) place[half][k] = direction;
    }
  }
};

}  // namespace helio
