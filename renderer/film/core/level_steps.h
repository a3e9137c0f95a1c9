// Samples of many pixels as a function of one level that rises: how many they have at the least, and at which levels
// one of them gets more. Answers which level a number of samples can afford.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace helio {

class LevelSteps {
 public:
  void add_least(std::uint64_t samples) { least_ += samples; }
  // A pixel gets `more` samples from `level` >= 0 on.
  void add(float level, std::uint32_t more) { bins_[bin_of(level)] += more; }
  void add(const LevelSteps& other) {
    least_ += other.least_;
    for (std::size_t i = 0; i < kBins; ++i) bins_[i] += other.bins_[i];
  }

  std::uint64_t least() const { return least_; }

  struct Affordable {
    double level = 0;
    std::uint64_t samples = 0;  // that it takes, at least least()
  };
  // The highest level, to a 64th of an octave, at which no more samples than allowed are taken, or the lowest.
  Affordable highest(double allowed) const {
    std::uint64_t samples = least_;
    std::size_t bin = 0;
    for (; bin + 1 < kBins && double(samples + bins_[bin]) <= allowed; ++bin) samples += bins_[bin];
    return {double(level_of(bin)), samples};
  }

 private:
  // A float's exponent and the upper bits of its mantissa are its logarithm, in pieces.
  static constexpr int kMantissaBits = 6, kShift = 23 - kMantissaBits;
  static constexpr int kLowest = -64, kHighest = 96;  // octaves
  static constexpr std::uint32_t kFirst = std::uint32_t(127 + kLowest) << kMantissaBits;
  static constexpr std::size_t kBins = std::size_t(kHighest - kLowest) << kMantissaBits;

  static std::size_t bin_of(float level) {
    const std::uint32_t code = std::bit_cast<std::uint32_t>(level) >> kShift;
    return std::min<std::size_t>(code > kFirst ? code - kFirst : 0, kBins - 1);
  }
  // The lowest level of the bin.
  static float level_of(std::size_t bin) { return std::bit_cast<float>((kFirst + std::uint32_t(bin)) << kShift); }

  std::uint64_t least_ = 0;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(kBins);
};

}  // namespace helio
