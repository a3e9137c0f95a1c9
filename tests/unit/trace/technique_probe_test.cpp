#include "renderer/trace/technique_probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace helio {
namespace {

using Estimates = std::vector<TechniqueProbe::Estimate>;

TEST(TechniqueChoice, NoiseAlikeLeavesThePathTracer) {
  const Estimates path(9, {0.1, 5}), bdpt(9, {0.1, 15});
  for (const bool on : TechniqueProbe::choose(path, bdpt)) EXPECT_FALSE(on);
}

TEST(TechniqueChoice, ManyTimesLessNoiseIsWorthItsCost) {
  const Estimates path(9, {1.0, 5}), bdpt(9, {0.1, 15});
  for (const bool on : TechniqueProbe::choose(path, bdpt)) EXPECT_TRUE(on);
}

// A tenth of the tiles makes all the error: where light paths are dear, they go there alone.
TEST(TechniqueChoice, WhereTheErrorIsLightPathsGo) {
  Estimates path(40, {0.001, 5}), bdpt(40, {0.001, 2000});
  for (std::size_t t = 0; t < 4; ++t) {
    path[t].error = 100;
    bdpt[t].error = 0.05;
  }
  const std::vector<bool> on = TechniqueProbe::choose(path, bdpt);
  for (int t = 0; t < 40; ++t) EXPECT_EQ(on[std::size_t(t)], t < 4) << t;
}

// Against every choice there is, of six tiles.
TEST(TechniqueChoice, NoOtherChoiceIsMuchBetter) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> spread(-3, 3);
  for (int n = 0; n < 200; ++n) {
    Estimates path(6), bdpt(6);
    for (std::size_t t = 0; t < 6; ++t) {
      path[t] = {std::exp(spread(generator)), 4};
      bdpt[t] = {std::exp(spread(generator)), 4 * (1 + std::exp(spread(generator) / 3))};
    }
    const auto product = [&](unsigned set) {
      double rest = 0, with = 0, cost = 0;
      int count = 0;
      for (unsigned t = 0; t < 6; ++t) {
        const bool on = set >> t & 1;
        count += on;
        (on ? with : rest) += on ? bdpt[t].error : path[t].error;
        cost += on ? bdpt[t].cost : path[t].cost;
      }
      return (rest + with * (count > 0 ? 0.5 + 0.5 * 6 / count : 0.0)) * cost;
    };
    const std::vector<bool> on = TechniqueProbe::choose(path, bdpt);
    unsigned chosen = 0;
    for (unsigned t = 0; t < 6; ++t) chosen |= on[t] ? 1u << t : 0;
    double best = product(0);
    for (unsigned set = 1; set < 64; ++set) best = std::min(best, product(set));
    // Tiles enter one by one in the order of gain over cost, which is not the best of all 64 to the last percent, and a
    // choice between tiles has to gain 30 % over none.
    EXPECT_LE(product(chosen), 1.25 * best / 0.7);
  }
}

TEST(TechniqueChoice, ZeroesAndEqualCostsAreNoTrouble) {
  for (const double error : {0.0, 1e-300, 1e300}) {
    for (const double cost : {1.0, 1e9}) {
      const Estimates path(5, {error, cost}), bdpt(5, {0, cost});
      EXPECT_EQ(TechniqueProbe::choose(path, bdpt).size(), 5u);
    }
  }
}

}  // namespace
}  // namespace helio
