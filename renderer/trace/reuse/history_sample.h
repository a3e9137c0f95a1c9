// What an earlier picture says of a pixel of the new one, from the pixels that were looked up there.
#pragma once

#include <cstddef>

#include "renderer/base/check.h"
#include "renderer/base/math.h"
#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/core/lanes.h"
#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/history_source.h"

namespace helio {

inline constexpr int kMostTaps = 4;  // pixels of a lookup
// Of a lookup's pixels: the share of the weight that must be usable.
inline constexpr float kLeastLookupWeight = 0.1f;

// What a source says of a pixel.
struct HistorySample {
  float count[kHalves] = {0, 0};  // effective samples after the bias has its say; 0: nothing
  float mean[kHalves][3] = {};
  float spread[kHalves][3] = {};  // variance of one sample
  float bias2 = 0;
  float age = 0;
  const SourcePixel* kept = nullptr;  // it is this pixel as it was
  DirectionReservoir directions;

  float total() const { return count[0] + count[1]; }
};

// Sums over the pixels of a lookup, each times its weight.
struct LookupSums {
  Float8 means = {};    // three of each half, then 1 / count of each half
  Float8 spreads = {};  // three of each half, then bend2
  Float4 rest = {};     // weight of each half, slope2, age
  float bias2 = 0;
  // Of each pixel with two samples or more: its weight and the channels' mean spread.
  struct Spread {
    float weight, value;
  };
  Spread known_spreads[kHalves][kMostTaps];
  int known[kHalves] = {0, 0};

  // Of a pixel of that weight, its radiance times `modulation`; at most kMostTaps of them.
  void add(const SourcePixel& pixel, float w, const Rgb& modulation);

  // What they say together. resampled: squared error of the lookup, over the sums'. view_reweighting: relative to the
  // mean. arrival: radiance that may have come into view, a guess. Where the view has changed, halves that may be off
  // by more than half of the mean say nothing.
  HistorySample weigh(float resampled, float view_reweighting, const Rgb& arrival) const;

  float mean(int h, int c) const { return means[3 * h + c]; }
  float inverse_count(int h) const { return means[6 + h]; }
  float spread(int h, int c) const { return spreads[3 * h + c]; }
  float bend2(int axis) const { return spreads[6 + axis]; }
  float weight(int h) const { return rest[h]; }
  float slope2() const { return rest[2]; }
  float age() const { return rest[3]; }
};

namespace detail {

static_assert(offsetof(SourcePixel, packed_spread) + 8 == offsetof(SourcePixel, packed_structure));

// Means of both halves, then one over their counts; none of a half that is not known.
inline Float8 means_and_counts(const SourcePixel& pixel) {
  Float4 a, b;
  pixel.means.unpack(a, b);
  if (!pixel.known(0)) a = Float4{};
  if (!pixel.known(1)) b = Float4{};
  Float8 values = __builtin_shufflevector(a, b, 0, 1, 2, 4, 5, 6, 3, 7);
  values[6] = pixel.inverse_count(0);
  values[7] = pixel.inverse_count(1);
  return values;
}

// unpack_short_number() of both halves' spreads, then the second differences.
inline Float8 spreads_and_bends(const SourcePixel& pixel) {
  UInt4 packed;
  load(&pixel.packed_spread, packed);  // the structure, and what comes after it
  const UInt8 codes =
      __builtin_shufflevector(packed, packed, 0, 0, 0, 1, 1, 1, 2, 2) >> UInt8{0, 10, 20, 0, 10, 20, 0, 10} & 1023u;
  const UInt8 numbers = (codes + kShortNumberOffset) << 20;
  return (Float8)(codes == 0u ? UInt8{} : numbers);
}

}  // namespace detail

inline void LookupSums::add(const SourcePixel& pixel, float w, const Rgb& modulation) {
  const Rgb& m = modulation;
  const Float8 factors = {m.x, m.y, m.z, m.x, m.y, m.z, 1, 1};
  means += detail::means_and_counts(pixel) * factors * w;
  const Float8 own_spreads = detail::spreads_and_bends(pixel) * (factors * factors);
  spreads += own_spreads * w;
  for (int h = 0; h < kHalves; ++h) {
    if (!pixel.known(h) || !(pixel.inverse_count(h) < 1)) continue;
    const float value = (own_spreads[3 * h] + own_spreads[3 * h + 1] + own_spreads[3 * h + 2]) / 3;
    HELIO_DCHECK(known[h] < kMostTaps);
    known_spreads[h][known[h]++] = {w, value};
  }
  rest += Float4{pixel.known(0) ? 1.0f : 0.0f, pixel.known(1) ? 1.0f : 0.0f, pixel.slope2(), pixel.age()} * w;
  bias2 += w * (sqr(m.x) + sqr(m.y) + sqr(m.z)) * (1.0f / 3) * pixel.bias2();
}

// Squared error of resampling a step edge whose squared second differences sum to one, along one axis, `between` of the
// way from one pixel to the next; `zoom`: size of an old pixel over that of a new one. Bilinear lookup of a step at a
// random place, between boxes of one size, is off by (2/3) (f (1 - f))^2 of its squared second differences, f: how far
// between two pixels; boxes of sizes 1 and 1/s by (1 - 1/s)^2 / 12, or s (1/s - 1)^2 / 12 for s < 1; both together by
// e f (1 - f) / 4 more, e: 1 - 1/s (integrals over the edge's place; the last one fitted).
float resampling_error2(float between, float zoom);

}  // namespace helio
