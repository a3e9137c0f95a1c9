// Counts of pixels that hold samples of earlier pictures.
#include "renderer/film/allocation/fill_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "tests/support/allocation_rounds.h"

namespace helio {
namespace {

constexpr int kWidth = 48, kHeight = 32;

// `count` samples of mean 1 whose deviation is about `deviation`, carried or not.
void add(Film& film, int h, int x, int y, std::uint32_t count, float deviation, bool carried) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const float v = 1 + (i % 2 ? deviation : -deviation);
    film.half(h, x, y).add(Rgb(v, v, v));
  }
  if (!carried) return;
  film.history()->carried(x, y).count[h] = count;
  film.history()->carried(x, y).means = PackedMeans(Rgb(1), Rgb(1));
}

void allocate(Film& film, double mean) {
  AllocationRequest request;
  request.mean = mean;
  request.fill = true;
  test::allocate_round(film, {}, request);
}

constexpr PixelRect kLeft = {0, 0, kWidth / 2, kHeight}, kRight = {kWidth / 2, 0, kWidth, kHeight};

TEST(FillAllocation, GivesToThoseThatLack) {
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int h = 0; h < kHalves; ++h) add(film, h, x, y, x < kWidth / 2 ? 64 : 4, 0.5f, true);
    }
  }
  allocate(film, 16);
  for (int h = 0; h < kHalves; ++h) {
    // Of 16 a pixel the richer half of the picture needs nothing, but for the least share of 1/8.
    EXPECT_EQ(test::mean_target(film, h, kLeft), 2);
    EXPECT_LE(test::mean_target(film, h, film.bounds()), 16);
    EXPECT_GT(test::mean_target(film, h, film.bounds()), 14);
  }
}

TEST(FillAllocation, GivesByDeviation) {
  // Equal history, three times the deviation on the right: N + n is to be three times as much there.
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int h = 0; h < kHalves; ++h) add(film, h, x, y, 16, x < kWidth / 2 ? 0.2f : 0.6f, true);
    }
  }
  allocate(film, 64);
  for (int h = 0; h < kHalves; ++h) {
    const PixelRect left = {0, 0, kWidth / 2 - 4, kHeight}, right = {kWidth / 2 + 4, 0, kWidth, kHeight};
    const double ratio = (16 + test::mean_target(film, h, right)) / (16 + test::mean_target(film, h, left));
    EXPECT_NEAR(ratio, 3, 0.5);
  }
}

// `share` of the picture's columns, from the left, carry rich history; the mean is that of its first picture.
Film first_round(double share) {
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < int(share * kWidth); ++x) {
      for (int h = 0; h < kHalves; ++h) add(film, h, x, y, 1000, 0.5f, true);
    }
  }
  allocate(film, 0.5);
  return film;
}

TEST(FillAllocation, TheFirstSamplesGoToPixelsWithoutHistory) {
  const Film film = first_round(0.5);
  for (int h = 0; h < kHalves; ++h) {
    // Of the others an eighth is looked at.
    EXPECT_NEAR(test::mean_target(film, h, kLeft), 0.125, 0.04);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = kRight.x0; x < kWidth; ++x) EXPECT_GE(film.targets()->target(0, x, y), 1u);
    }
  }
  EXPECT_NEAR(test::mean_target(film, 0, film.bounds()) + test::mean_target(film, 1, film.bounds()), 1, 0.07);
  // Of a few, each gets as many as it may.
  const Film mostly_known = first_round(7.0 / 8);
  for (int h = 0; h < kHalves; ++h)
    EXPECT_GE(test::mean_target(mostly_known, h, {kWidth * 7 / 8, 0, kWidth, kHeight}), 2);
}

TEST(FillAllocation, WithLittleHistoryTheFirstHalfComesFirst) {
  const Film film = first_round(0.25);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kWidth / 4; x < kWidth; ++x) EXPECT_EQ(film.targets()->target(0, x, y), 1u);
  }
  EXPECT_LE(test::mean_target(film, 0, film.bounds()) + test::mean_target(film, 1, film.bounds()), 1.02);
}

TEST(FillAllocation, HalfOfThePixelsIsLookedAtFromTheMeanThatSaysSo) {
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int h = 0; h < kHalves; ++h) add(film, h, x, y, 1000, x < 4 ? 2.0f : 0.1f, true);
    }
  }
  allocate(film, kHalfCheckedMean);
  std::size_t looked_at = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 16; x < kWidth; ++x) {
      // The same pixels in both halves: only these are held against their history (film/history/history_rejection.h).
      EXPECT_EQ(film.targets()->target(0, x, y) > 0, film.targets()->target(1, x, y) > 0);
      looked_at += film.targets()->target(0, x, y) > 0;
    }
  }
  EXPECT_NEAR(double(looked_at) / (kHeight * (kWidth - 16)), 0.5, 0.04);
}

TEST(FillAllocation, PixelsWithoutHistoryAreLookedAtBeforeTheyAreLeftAlone) {
  // History is smooth; what has come into view is not, and its surroundings say that it needs nothing. It gets what is
  // asked for on average, up to four samples a half, and once it has these they count.
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) {
      for (int h = 0; h < kHalves; ++h) add(film, h, x, y, 256, 0.05f, true);
    }
  }
  for (const double mean : {1.0, 2.0, 4.0, 8.0, 16.0}) {
    allocate(film, mean);
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const std::uint32_t target = film.targets()->target(h, x, y);
          if (x >= kWidth / 2) {
            EXPECT_GE(target, std::min(mean, 4.0));
          }
          const std::uint32_t missing = target - film.attempted(h, x, y);
          add(film, h, x, y, missing, x < kWidth / 2 ? 0.05f : 0.9f, false);
        }
      }
    }
  }
  EXPECT_TRUE(film.targets()->fresh_demand_known);
  for (int h = 0; h < kHalves; ++h)
    EXPECT_GT(test::mean_target(film, h, kRight), 8 * test::mean_target(film, h, kLeft));
}

// Targets of both halves in two rounds, when half 0's samples are noisy between the columns [from, to): history's, and
// in the right part, which carries nothing, those of the first round.
struct Rounds {
  std::vector<std::uint32_t> targets[2][kHalves];
};

Rounds rounds_with_noise(int from, int to) {
  const auto deviation = [&](int half, int x) { return half == 0 && x >= from && x < to ? 0.9f : 0.1f; };
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) {
      for (int half = 0; half < kHalves; ++half) add(film, half, x, y, 8, deviation(half, x), true);
    }
  }
  Rounds rounds;
  for (int round = 0; round < 2; ++round) {
    allocate(film, round == 0 ? 16 : 32);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int h = 0; h < kHalves; ++h) {
          const std::uint32_t target = film.targets()->target(h, x, y);
          rounds.targets[round][h].push_back(target);
          add(film, h, x, y, target - film.attempted(h, x, y), deviation(h, x), false);
        }
      }
    }
  }
  EXPECT_TRUE(film.targets()->fresh_demand_known);  // the second round has looked at fresh samples
  return rounds;
}

// Samples that pixels without history have had before the first round, of the first half, are no measure of what the
// second half's cost: blocks that have none would look cheaper.
TEST(FillAllocation, FirstSamplesDoNotChangeWhatOthersAsk) {
  Film film(kWidth, kHeight, {.targets = true, .history = true});
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (x > 0 || y > 0) add(film, h, x, y, 8, 0.5f, true);
      }
    }
  }
  add(film, 0, 0, 0, 1, 0, false);
  film.add_work(0, 0, 0, 20, 1);
  allocate(film, 0.5);
  EXPECT_NEAR(film.targets()->demand(1, 12, 12), film.targets()->demand(1, 40, 12), 0.05);
}

TEST(FillAllocation, CountsOfAHalfDoNotDependOnItsOwnSamples) {
  // Whatever half 0 has seen, of history or of fresh samples, is the other half's business. (What it has seen of
  // history does reach its second round, by way of how many samples the other half was given in the first.)
  const Rounds even = rounds_with_noise(0, 0), history = rounds_with_noise(4, 14), fresh = rounds_with_noise(34, 44);
  EXPECT_EQ(history.targets[0][0], even.targets[0][0]);
  EXPECT_NE(history.targets[0][1], even.targets[0][1]);
  for (int h = 0; h < kHalves; ++h) EXPECT_EQ(fresh.targets[0][h], even.targets[0][h]);
  EXPECT_EQ(fresh.targets[1][0], even.targets[1][0]);
  EXPECT_NE(fresh.targets[1][1], even.targets[1][1]);
}

}  // namespace
}  // namespace helio
