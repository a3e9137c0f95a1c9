// How often rare, large errors are found to decide a mean, where they do and where they do not.
#include "renderer/comparison/heavy_tails.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "tests/unit/picture/comparison/draws.h"

namespace helio {
namespace {

using test::Draws;

constexpr int kRuns = 1000;

// In what part of the runs it is said of seeds whose errors are drawn like this; shares: of their pixels, from an
// error.
double said(const std::string& name, int seeds, const std::function<double(Draws&)>& error,
            const std::function<double(double, Draws&)>& share = nullptr) {
  Draws draws(7);
  int count = 0;
  for (int run = 0; run < kRuns; ++run) {
    const std::vector<double> errors = test::draw_many(seeds, [&] { return error(draws); });
    std::vector<double> shares;
    if (share) {
      for (const double e : errors) shares.push_back(share(e, draws));
    }
    count += few_pixels_decide(errors, shares);
  }
  testing::Test::RecordProperty(name + " " + std::to_string(seeds), std::to_string(count));
  return double(count) / kRuns;
}

double small_share(double, Draws& draws) {
  return 0.01 + 0.05 * draws.uniform();
}

TEST(ComparisonHeavyTails, AreFoundInTenNumbers) {
  for (const double exponent : {0.5, 1.0, 1.2, 1.5}) {
    EXPECT_GE(said("pareto", 10, [&](Draws& d) { return d.pareto(exponent); }), 0.95) << exponent;
    EXPECT_GE(said("pareto", 20, [&](Draws& d) { return d.pareto(exponent); }), 0.93) << exponent;
  }
  for (const double sigma : {2.5, 3.0, 5.0, 20.0}) {
    EXPECT_GE(said("log-normal", 10, [&](Draws& d) { return d.log_normal(sigma); }), 0.95) << sigma;
  }
}

// Ten numbers do not decide it, and the test does not hide that: half of all runs of sigma 1 look like a Pareto tail.
TEST(ComparisonHeavyTails, AreOftenSaidFalselyFromTenNumbersAlone) {
  EXPECT_LE(said("normal 10 %", 10, [](Draws& d) { return d.normal(1, 0.1); }), 0.01);
  EXPECT_LE(said("normal 30 %", 10, [](Draws& d) { return std::max(1e-3, d.normal(1, 0.3)); }), 0.25);
  EXPECT_LE(said("normal, mean 0", 10, [](Draws& d) { return d.normal(); }), 0.02);
  EXPECT_LE(said("log-normal 1", 10, [](Draws& d) { return d.log_normal(1); }), 0.62);
  EXPECT_LE(said("log-normal 1", 20, [](Draws& d) { return d.log_normal(1); }), 0.10);
}

TEST(ComparisonHeavyTails, AreSeldomSaidFalselyWherePixelsAreKnown) {
  for (const int seeds : {5, 10, 20}) {
    EXPECT_LE(said(
                  "normal 10 %, pixels", seeds, [](Draws& d) { return d.normal(1, 0.1); }, small_share),
              0.01);
    EXPECT_LE(said(
                  "normal 30 %, pixels", seeds, [](Draws& d) { return std::max(1e-3, d.normal(1, 0.3)); }, small_share),
              0.02);
    EXPECT_LE(said(
                  "normal, mean 0, pixels", seeds, [](Draws& d) { return d.normal(); }, small_share),
              0.02);
    EXPECT_LE(said(
                  "log-normal 1, pixels", seeds, [](Draws& d) { return d.log_normal(1); }, small_share),
              0.08);
  }
}

// Errors of ten seeds from a Pareto tail that is that of a few pixels: all that is above the smallest possible error.
TEST(ComparisonHeavyTails, OfAFewPixelsAreFoundInTheirShare) {
  const auto share_above_one = [](double error, Draws&) { return 1 - 1 / error; };
  for (const double exponent : {1.0, 1.5}) {
    EXPECT_GE(said(
                  "pareto, pixels", 10, [&](Draws& d) { return d.pareto(exponent); }, share_above_one),
              0.95);
  }
  EXPECT_GE(said(
                "log-normal 2.5, pixels", 10, [](Draws& d) { return d.log_normal(2.5); }, small_share),
            0.90);
}

// The seeds' errors have a heavy tail, and no seed's pixels say so.
TEST(ComparisonHeavyTails, ThatPixelsDoNotShowAreOftenMissed) {
  const auto found = [](const char* name, int seeds, const std::function<double(Draws&)>& error, double low,
                        double high) {
    const double share = said(name, seeds, error, small_share);
    EXPECT_GE(share, low) << name << " " << seeds;
    EXPECT_LE(share, high) << name << " " << seeds;
  };
  for (const double exponent : {1.0, 1.5}) {
    const auto pareto = [exponent](Draws& d) { return d.pareto(exponent); };
    found("pareto, small shares", 5, pareto, 0.08, 0.25);
    found("pareto, small shares", 10, pareto, 0.47, 0.63);
    found("pareto, small shares", 20, pareto, 0.83, 0.95);
  }
  found(
      "log-normal 2, small shares", 10, [](Draws& d) { return d.log_normal(2); }, 0.75, 0.85);
}

// 1,000 pixels with normal errors, one of them with more than all others: the share of that one.
struct Sums {
  double total = 0, largest = 0;
};
Sums picture(Draws& draws, double spike) {
  Sums sums;
  for (int i = 0; i < 999; ++i) {
    const double e = draws.uniform() * draws.uniform();
    sums.total += e;
    sums.largest = std::max(sums.largest, e);
  }
  sums.total += spike;
  sums.largest = std::max(sums.largest, spike);
  return sums;
}

TEST(ComparisonHeavyTails, ArePicturesInWhichOnePixelOfAThousandHasMostOfTheError) {
  Draws draws(3);
  int with = 0, without = 0;
  constexpr int kPictureRuns = 100;
  for (int run = 0; run < kPictureRuns; ++run) {
    std::vector<double> spiked, spiked_shares, even, even_shares;
    for (int seed = 0; seed < 10; ++seed) {
      // The others come to 250; the spike of each seed is 300 to 900.
      const Sums a = picture(draws, 300 + 600 * draws.uniform()), b = picture(draws, 0);
      spiked.push_back(a.total);
      spiked_shares.push_back(a.largest / a.total);
      even.push_back(b.total);
      even_shares.push_back(b.largest / b.total);
    }
    with += few_pixels_decide(spiked, spiked_shares);
    without += few_pixels_decide(even, even_shares);
  }
  EXPECT_EQ(with, kPictureRuns);
  EXPECT_EQ(without, 0);
}

TEST(ComparisonHeavyTails, OfFewSeedsAreSaidByTheirPixelsAlone) {
  EXPECT_TRUE(few_pixels_decide(std::vector<double>{3}, std::vector<double>{0.7}));
  EXPECT_FALSE(few_pixels_decide(std::vector<double>{3}, std::vector<double>{0.2}));
  EXPECT_FALSE(few_pixels_decide(std::vector<double>{1, 1, 1, 1e9}));
  EXPECT_FALSE(few_pixels_decide({}));
}

TEST(ComparisonHeavyTails, AreOneSeedFarFromAllOthersWhereErrorsHaveBothSigns) {
  const std::vector<double> values = {-0.1, 0.2, 0.1, -0.2, 0.05, -0.05, 0.15, 40};
  EXPECT_TRUE(few_pixels_decide(values));
  EXPECT_FALSE(few_pixels_decide(std::span(values).first(7)));
}

TEST(ComparisonHeavyTails, AreNotThoseOfEqualOrExtremeValues) {
  EXPECT_FALSE(few_pixels_decide(std::vector<double>(10, 0.0)));
  EXPECT_FALSE(few_pixels_decide(std::vector<double>(10, 1e300)));
  EXPECT_FALSE(few_pixels_decide(std::vector<double>(10, 0.0), std::vector<double>(10, 0.0)));
  const std::vector<double> huge = {1e300, 1.1e300, 0.9e300, 1e300, 1.05e300, 1e300, 0.95e300, 1e300, 1e300, 1e300};
  EXPECT_FALSE(few_pixels_decide(huge));
  const std::vector<double> tiny = {5e-324, 1e-300, 1, 1e30, 1e-30, 1, 1, 2, 3, 4};
  EXPECT_TRUE(few_pixels_decide(tiny));
}

}  // namespace
}  // namespace helio
