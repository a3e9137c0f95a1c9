// How many samples each pixel of a picture is to have, where that is not the same number everywhere (mode `adaptive`).
//
// Each half has its own counts: those of half A are decided from what half B has seen and the reverse, so that no
// pixel's count depends on its own samples (film/neyman_allocation.h). A round brings every pixel from the count that
// it has to its target. Within a round, level s is the sample of index s of every pixel that takes part in it:
// attempted <= s < target.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "renderer/film/film.h"

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
  SampleTargets(int width, int height)
      : width_(width), columns_((width + kFilmBlock - 1) / kFilmBlock), rows_((height + kFilmBlock - 1) / kFilmBlock) {
    const auto pixels = std::size_t(width) * std::size_t(height);
    for (int h = 0; h < kHalves; ++h) {
      target_[h].resize(pixels);
      demand_[h].resize(pixels);
    }
    blocks_.resize(std::size_t(columns_) * std::size_t(rows_));
  }

  std::uint32_t& target(int h, int x, int y) { return target_[h][index(x, y)]; }
  std::uint32_t target(int h, int x, int y) const { return target_[h][index(x, y)]; }
  // What the rule that fills the targets keeps per pixel; see there.
  float& demand(int h, int x, int y) { return demand_[h][index(x, y)]; }
  float demand(int h, int x, int y) const { return demand_[h][index(x, y)]; }
  BlockLevels& block(int x, int y) { return blocks_[block_index(x, y)]; }  // of the pixel (x, y)
  const BlockLevels& block(int x, int y) const { return blocks_[block_index(x, y)]; }

  // Whether the pixel takes part in level s of the round, given what it has.
  bool wants(const Film& film, int h, int x, int y, std::uint32_t s) const {
    return film.attempted(h, x, y) <= s && s < target(h, x, y);
  }
  // Samples of one half that pixels of the window, which lies in the film, take in levels [first, first + count).
  std::uint64_t samples_in(const Film& film, int h, const PixelRect& window, std::uint32_t first,
                           std::uint32_t count) const;

  // Sums of the round in hand; of no meaning before the first.
  RoundSummary round;
  // Whether demand() holds a pilot's, or history's; cleared when another picture begins.
  bool demand_known = false;
  float exponent = 1;  // bounded variant: counts follow demand to this power, [0, 1]
  // With history: demand of pixels of which nothing is known, the samples that each of these has been given at least,
  // and whether fresh samples have had their say.
  float usual_demand[kHalves] = {0, 0};
  std::uint32_t fresh_least = 0;
  bool fresh_demand_known = false;
  // Of demand(), per half: pixels by value, as the rule that fills them defines it.
  std::vector<std::uint32_t> histogram[kHalves];

  std::size_t bytes() const {
    std::size_t total = blocks_.capacity() * sizeof(BlockLevels);
    for (int h = 0; h < kHalves; ++h) {
      total += target_[h].capacity() * sizeof(std::uint32_t) + demand_[h].capacity() * sizeof(float) +
               histogram[h].capacity() * sizeof(std::uint32_t);
    }
    return total;
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }
  std::size_t block_index(int x, int y) const {
    return std::size_t(y / kFilmBlock) * std::size_t(columns_) + std::size_t(x / kFilmBlock);
  }

  int width_, columns_, rows_;
  std::vector<std::uint32_t> target_[kHalves];
  std::vector<float> demand_[kHalves];
  std::vector<BlockLevels> blocks_;
};

}  // namespace helio
