#include "renderer/trace/selection/tile_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace helio {
namespace {

using Estimates = std::vector<TileEstimate>;

TEST(TileSelection, NoiseAlikeLeavesThePathTracer) {
  for (const bool on : choose_tiles(Estimates(9, {{0.1, 5}, {0.1, 15}})).on) EXPECT_FALSE(on);
}

TEST(TileSelection, ManyTimesLessNoiseIsWorthItsCost) {
  for (const bool on : choose_tiles(Estimates(9, {{1.0, 5}, {0.1, 15}})).on) EXPECT_TRUE(on);
}

// A tenth of the tiles makes all the error: where light paths are dear, they go there alone.
TEST(TileSelection, WhereTheErrorIsLightPathsGo) {
  Estimates tiles(40, {{0.001, 5}, {0.001, 2000}});
  for (std::size_t t = 0; t < 4; ++t) {
    tiles[t].path.error = 100;
    tiles[t].bdpt.error = 0.05;
  }
  const std::vector<bool> on = choose_tiles(tiles).on;
  for (int t = 0; t < 40; ++t) EXPECT_EQ(on[std::size_t(t)], t < 4) << t;
}

// Against every choice there is, of six tiles.
TEST(TileSelection, NoOtherChoiceIsMuchBetter) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> spread(-3, 3);
  for (int n = 0; n < 200; ++n) {
    Estimates tiles(6);
    for (TileEstimate& tile : tiles) {
      tile.path = {std::exp(spread(generator)), 4};
      tile.bdpt = {std::exp(spread(generator)), 4 * (1 + std::exp(spread(generator) / 3))};
    }
    const auto product = [&](unsigned set) {
      double rest = 0, with = 0, cost = 0;
      int count = 0;
      for (unsigned t = 0; t < 6; ++t) {
        const bool on = set >> t & 1;
        count += on;
        (on ? with : rest) += on ? tiles[t].bdpt.error : tiles[t].path.error;
        cost += on ? tiles[t].bdpt.cost : tiles[t].path.cost;
      }
      return (rest + with * (count > 0 ? 0.5 + 0.5 * 6 / count : 0.0)) * cost;
    };
    const std::vector<bool> on = choose_tiles(tiles).on;
    unsigned chosen = 0;
    for (unsigned t = 0; t < 6; ++t) chosen |= on[t] ? 1u << t : 0;
    double best = product(0);
    for (unsigned set = 1; set < 64; ++set) best = std::min(best, product(set));
    // Tiles enter one by one in the order of gain over cost, which is not the best of all 64 to the last percent, and a
    // choice between tiles has to gain 30 % over none.
    EXPECT_LE(product(chosen), 1.25 * best / 0.7);
  }
}

TEST(TileSelection, IsClearWhereTheOtherWayIsTwiceAsDearForAllTiles) {
  EXPECT_TRUE(choose_tiles(Estimates(9, {{0.1, 5}, {0.1, 15}})).clear);
  EXPECT_FALSE(choose_tiles(Estimates(9, {{0.1, 5}, {0.06, 15}})).clear);
  EXPECT_TRUE(choose_tiles(Estimates(9, {{1.0, 5}, {0.1, 15}})).clear);
  Estimates mixed(40, {{0.001, 5}, {0.001, 2000}});
  mixed[7] = {{100, 5}, {0.05, 2000}};
  EXPECT_FALSE(choose_tiles(mixed).clear);
  EXPECT_FALSE(choose_tiles({}).clear);
}

TEST(TileSelection, ZeroesAndEqualCostsAreNoTrouble) {
  for (const double error : {0.0, 1e-300, 1e300}) {
    for (const double cost : {1.0, 1e9}) {
      EXPECT_EQ(choose_tiles(Estimates(5, {{error, cost}, {0, cost}})).on, std::vector<bool>(5, error > 0));
    }
  }
}

}  // namespace
}  // namespace helio
