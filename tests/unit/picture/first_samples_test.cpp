#include "renderer/film/allocation/first_samples.h"

#include <gtest/gtest.h>

#include "renderer/film/core/film_windows.h"
#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

void carry(Film& film, int h, int x, int y, std::uint32_t count) {
  film.history()->carried(x, y).count[h] = count;
  for (std::uint32_t i = 0; i < count; ++i) film.half(h, x, y).add(Rgb(1, 1, 1));
}

// Whatever is carried, of either half, is enough.
TEST(FirstSamples, GoToPixelsThatCarryNothing) {
  Film film(40, 33, {.targets = true, .history = true});
  const PixelRect region = {3, 2, 40, 33};
  std::uint64_t expected = 0;
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      // Blocks of the second column carry something everywhere.
      const int kind = x >= 16 && x < 32 ? 1 + x % 2 : (x + 2 * y) % 3;
      if (kind > 0) carry(film, kind - 1, x, y, kind == 1 ? 5 : 1);
      expected += kind == 0;
    }
  }
  std::uint64_t samples = 0;
  for (const PixelRect& window : cut_aligned(region, 32, 16)) samples += target_first_samples(film, window);
  EXPECT_EQ(samples, expected);
  const SampleTargets& targets = *film.targets();
  std::uint64_t wanted = 0;
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      const CarriedPixel& carried = film.history()->carried(x, y);
      EXPECT_EQ(targets.wants(film, 0, x, y, 0), carried.count[0] == 0 && carried.count[1] == 0);
      EXPECT_EQ(targets.target(1, x, y), 0u);
      EXPECT_FALSE(targets.wants(film, 0, x, y, 1));
      wanted += targets.wants(film, 0, x, y, 0);
    }
  }
  EXPECT_EQ(wanted, expected);
  EXPECT_EQ(targets.block(8, 8).top[0], 1u);
  EXPECT_EQ(targets.block(20, 8).top[0], 0u) << "the block is left alone";
  EXPECT_EQ(targets.block(39, 32).top[1], 0u);
  EXPECT_EQ(targets.samples_in(film, 0, region, 0, 1), expected);

  const RoundSummary round = round_of_first_samples(samples);
  EXPECT_EQ(round.top[0], 1u);
  EXPECT_EQ(round.top[1], 0u);
  EXPECT_EQ(round.by_octave[0][0], expected);
  EXPECT_EQ(round_of_first_samples(0), RoundSummary());
}

}  // namespace
}  // namespace helio
