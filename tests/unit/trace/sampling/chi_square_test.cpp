// The judge is judged first: special functions against closed forms, and the power of the test itself.
#include "tests/support/chi_square.h"

#include <gtest/gtest.h>

#include <cmath>

#include "renderer/trace/sampling/warp.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

TEST(IncompleteGamma, EqualsClosedForms) {
  for (double x : {1e-8, 0.1, 0.5, 1.0, 2.0, 7.5, 30.0}) {
    // P(1/2, x) = erf(sqrt x), P(1, x) = 1 - e^-x.
    EXPECT_NEAR(regularized_gamma_p(0.5, x), std::erf(std::sqrt(x)), 1e-13);
    EXPECT_NEAR(regularized_gamma_q(0.5, x) / std::erfc(std::sqrt(x)), 1, 1e-12);
    EXPECT_NEAR(regularized_gamma_p(1, x) / -std::expm1(-x), 1, 1e-12);
  }
  // Q(n, x) = e^-x sum_{k < n} x^k / k!, the probability of fewer than n Poisson events.
  for (double x : {40.0, 50.0, 70.0}) {
    double term = std::exp(-x), sum = 0;
    for (int k = 0; k < 50; ++k) {
      sum += term;
      term *= x / (k + 1);
    }
    EXPECT_NEAR(regularized_gamma_q(50, x) / sum, 1, 1e-11) << x;
  }
}

TEST(IncompleteGamma, GivesTabulatedChiSquareQuantiles) {
  // 5 % points: 3.841459 (1), 18.307038 (10), 124.342113 (100), 1074.679 (1000 degrees of freedom).
  EXPECT_NEAR(regularized_gamma_q(0.5, 3.841459 / 2), 0.05, 1e-7);
  EXPECT_NEAR(regularized_gamma_q(5, 18.307038 / 2), 0.05, 1e-7);
  EXPECT_NEAR(regularized_gamma_q(50, 124.342113 / 2), 0.05, 1e-7);
  EXPECT_NEAR(regularized_gamma_q(500, 1074.679 / 2), 0.05, 1e-5);
  EXPECT_NEAR(regularized_gamma_q(1e5, 1e5), 0.5, 1e-3);
  EXPECT_THROW(regularized_gamma_p(0, 1), std::domain_error);
  EXPECT_THROW(regularized_gamma_q(1, -1), std::domain_error);
}

TEST(ChiSquare, SidakSpreadsTheSignificanceOverTheFamily) {
  EXPECT_DOUBLE_EQ(sidak_significance(0.01, 1), 0.01);
  EXPECT_NEAR(1 - std::pow(1 - sidak_significance(0.01, 500), 500), 0.01, 1e-12);
}

TEST(ChiSquare, PoolsSmallCells) {
  // Cells 1 + 2 + 3 = 6 make one pool, 10 and 20 stand alone: (7-6)^2/6 + (8-10)^2/10 + (21-20)^2/20, two degrees.
  const ChiSquareResult result = chi_square_test({21, 2, 1, 8, 4}, {20, 1, 2, 10, 3});
  EXPECT_EQ(result.degrees_of_freedom, 2);
  EXPECT_NEAR(result.statistic, 1.0 / 6 + 0.4 + 0.05, 1e-12);
  EXPECT_NEAR(result.p_value, std::exp(-0.5 * result.statistic), 1e-12);  // two degrees of freedom
}

TEST(ChiSquare, SamplesWhereNoneCanBeCountAgainstTheSmallestPool) {
  // (51 - 50)^2 / 50 for the full cell; the zero cells join the cell of 5: (5 + 20 - 5)^2 / 5 = 80.
  const ChiSquareResult result = chi_square_test({51, 5, 20, 0}, {50, 5, 0, 0});
  EXPECT_NEAR(result.statistic, 80 + 0.02, 1e-12);
  EXPECT_FALSE(result.passes(kSignificance, 1));
  EXPECT_FALSE(chi_square_test({3, 1}, {0, 0}).passes(kSignificance, 1));
}

TEST(SphereMap, InvertsItselfAndCoversTheSphere) {
  Random random(1);
  for (const double scale : {1.0, 1e-3}) {
    const SphereMap map(V3f(0.6f, 0.0f, -0.8f), scale);
    for (int i = 0; i < 1000; ++i) {
      // Directions are floats: a narrow map cannot resolve more than 1e-7 / scale of t near its axis.
      const double t0 = random.next_double(), phi0 = random.next_double();
      double t, phi;
      map.coordinates(map.direction(t0, phi0), t, phi);
      EXPECT_NEAR(t, t0, 1e-6 + 2e-7 / scale);
    }
    EXPECT_NEAR(integrate_sphere(map, [](const V3f&) { return 1 / (4 * std::numbers::pi); }), 1, 1e-5);
  }
}

ChiSquareResult cosine_samples_against(const SphereDensity& density, double share_kept = 1) {
  Random random(7);
  SphereHistogram histogram(V3f(0, 0, 1));
  for (int i = 0; i < 100'000; ++i) {
    const V2f u = random.next_v2f();
    if (random.next_double() < share_kept) {
      histogram.add(square_to_cosine_hemisphere(u));
    } else {
      histogram.add_elsewhere();
    }
  }
  return histogram.test(density);
}

TEST(SphereHistogram, AcceptsTheRightDensityAndNoOther) {
  const auto cosine = [](const V3f& w) { return std::max(0.0f, w.z) * kInvPi; };
  EXPECT_TRUE(cosine_samples_against(cosine).passes(kSignificance, 1));
  EXPECT_TRUE(cosine_samples_against([&](const V3f& w) { return 0.7 * cosine(w); }, 0.7).passes(kSignificance, 1));
  // Uniform, two percent too much, two percent too little, and slightly rotated.
  EXPECT_FALSE(cosine_samples_against([](const V3f& w) { return w.z > 0 ? kInvPi / 2 : 0; }).passes(kSignificance, 1));
  EXPECT_FALSE(cosine_samples_against([&](const V3f& w) { return 1.02 * cosine(w); }).passes(kSignificance, 1));
  EXPECT_FALSE(cosine_samples_against([&](const V3f& w) { return 0.98 * cosine(w); }).passes(kSignificance, 1));
  EXPECT_FALSE(
      cosine_samples_against([&](const V3f& w) { return cosine(w) * (1 + 0.15 * w.x); }).passes(kSignificance, 1));
}

}  // namespace
}  // namespace helio::test
