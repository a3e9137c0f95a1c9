// How many samples each pixel of a picture is to have, where that is not the same number everywhere (mode `adaptive`).
//
// Each half has its own counts: those of half A are decided from what half B has seen and the reverse, so that no
// pixel's count depends on its own samples (film/allocation/neyman_allocation.h). A round brings every pixel from the
// count that it has to its target. Within a round, level s is the sample of index s of every pixel that takes part in
// it: attempted <= s < target.
//
// Targets are powers of two, or 0, or one count that is the same everywhere, so that a byte holds one. Exact ones, of a
// rule that adds samples one by one, have the full width.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "renderer/base/check.h"
#include "renderer/film/core/film.h"

namespace helio {

// What a round asks of a block of kFilmBlock x kFilmBlock pixels, per half. Levels in [first, top) have takers; none
// when first >= top.
struct BlockLevels {
  std::uint32_t first[kHalves] = {0, 0}, top[kHalves] = {0, 0};
};

// What a round is, in sums.
struct RoundSummary {
  std::uint32_t top[kHalves] = {0, 0};  // no pixel takes part in this level and those above it
  // Samples that the round adds, over all pixels, whose level lies in [2^k, 2^(k+1)), at k; level 0 counts at 0.
  std::array<std::uint64_t, 32> by_octave[kHalves] = {};

  bool operator==(const RoundSummary&) const = default;
};

class SampleTargets {
 public:
  // exact: targets are any number, and the rule that fills them keeps no demand here.
  SampleTargets(int width, int height, bool exact)
      : width_(width),
        columns_((width + kFilmBlock - 1) / kFilmBlock),
        rows_((height + kFilmBlock - 1) / kFilmBlock),
        exact_(exact) {
    const auto pixels = std::size_t(width) * std::size_t(height);
    for (int h = 0; h < kHalves; ++h) {
      if (exact) {
        counts_[h].resize(pixels);
      } else {
        codes_[h].resize(pixels);
        demand_[h].resize(pixels);
      }
    }
    blocks_.resize(std::size_t(columns_) * std::size_t(rows_));
  }

  std::uint32_t target(int h, int x, int y) const {
    if (exact_) return counts_[h][index(x, y)];
    return count_of(codes_[h][index(x, y)], uniform);
  }
  // Exact ones as they are, others as the power of two below: what a pixel has already may be no such number, and asks
  // for nothing all the same.
  void set_target(int h, int x, int y, std::uint32_t count) {
    if (exact_) {
      counts_[h][index(x, y)] = count;
    } else {
      codes_[h][index(x, y)] = std::uint8_t(std::bit_width(count));
    }
  }
  // The target is `uniform`. Not of exact ones.
  void set_uniform(int h, int x, int y) {
    HELIO_DCHECK(!exact_);
    codes_[h][index(x, y)] = kUniform;
  }

  // What the rule that fills the targets keeps per pixel, where they are not exact: log2 of what it asks for, in
  // [-64, 64) by steps of 1/512, NaN: nothing is known.
  float demand(int h, int x, int y) const {
    const std::int16_t code = demand_[h][index(x, y)];
    return code == kUnknown ? std::numeric_limits<float>::quiet_NaN() : float(code) / kDemandSteps;
  }
  void set_demand(int h, int x, int y, float demand) {
    const float steps = std::clamp(std::round(demand * kDemandSteps), -32767.0f, 32767.0f);
    demand_[h][index(x, y)] = std::isnan(demand) ? kUnknown : std::int16_t(steps);
  }

  BlockLevels& block(int x, int y) { return blocks_[block_index(x, y)]; }  // of the pixel (x, y)
  const BlockLevels& block(int x, int y) const { return blocks_[block_index(x, y)]; }

  // Whether the pixel takes part in level s of the round, given what it has.
  bool wants(const Film& film, int h, int x, int y, std::uint32_t s) const {
    return film.attempted(h, x, y) <= s && s < target(h, x, y);
  }
  // Samples of one half that pixels of the window, which lies in the film, take in levels [first, first + count).
  std::uint64_t samples_in(const Film& film, int h, const PixelRect& window, std::uint32_t first,
                           std::uint32_t count) const;

  // For copies of the film (copy/film_copy.h), where targets are not exact: of a half, one a pixel.
  std::uint8_t* codes(int h) { return codes_[h].data(); }
  std::int16_t* demands(int h) { return demand_[h].data(); }
  static std::uint32_t count_of(std::uint8_t code, std::uint32_t uniform) {
    if (code == kUniform) return uniform;
    return code > 0 ? std::uint32_t(1) << (code - 1) : 0;
  }
  static bool is_code(std::uint8_t code) { return code == kUniform || code <= 32; }

  // Sums of the round in hand; of no meaning before the first.
  RoundSummary round;
  // Whether demand() holds a pilot's, or history's; cleared when another picture begins.
  bool demand_known = false;
  std::uint32_t uniform = 0;  // of pixels whose target is the same everywhere
  float exponent = 1;         // bounded variant: counts follow demand to this power, [0, 1]
  // With history: demand of pixels of which nothing is known, the samples that each of these has been given at least,
  // and whether fresh samples have had their say.
  float usual_demand[kHalves] = {0, 0};
  std::uint32_t fresh_least = 0;
  bool fresh_demand_known = false;
  // Of demand(), per half: pixels by value, as the rule that fills them defines it.
  std::vector<std::uint32_t> histogram[kHalves];

  static std::size_t bytes_per_pixel(bool exact) {
    return kHalves * (exact ? sizeof(std::uint32_t) : sizeof(std::uint8_t) + sizeof(std::int16_t));
  }
  std::size_t bytes() const {
    std::size_t total = blocks_.capacity() * sizeof(BlockLevels);
    for (int h = 0; h < kHalves; ++h) {
      total += counts_[h].capacity() * sizeof(std::uint32_t) + codes_[h].capacity() +
               demand_[h].capacity() * sizeof(std::int16_t) + histogram[h].capacity() * sizeof(std::uint32_t);
    }
    return total;
  }

 private:
  static constexpr std::uint8_t kUniform = 255;
  static constexpr std::int16_t kUnknown = std::numeric_limits<std::int16_t>::min();
  static constexpr float kDemandSteps = 512;

  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }
  std::size_t block_index(int x, int y) const {
    return std::size_t(y / kFilmBlock) * std::size_t(columns_) + std::size_t(x / kFilmBlock);
  }

  int width_, columns_, rows_;
  bool exact_;
  std::vector<std::uint8_t> codes_[kHalves];
  std::vector<std::int16_t> demand_[kHalves];
  std::vector<std::uint32_t> counts_[kHalves];  // exact
  std::vector<BlockLevels> blocks_;
};

}  // namespace helio
