// Pearson's chi-square test of a sampling routine against the density that it claims.
//
//   SphereHistogram histogram(axis, scale);
//   for (...) sample.valid ? histogram.add(direction) : histogram.add_elsewhere();
//   const ChiSquareResult result = histogram.test([&](const V3f& w) { return pdf_w(w); });
//   EXPECT_TRUE(result.passes(kSignificance, number_of_tests)) << result.summary();
//
// The expected counts are N times the integral of the claimed density, not normalised: a density that is wrong by a
// factor fails as surely as one of the wrong shape, and what is missing from 1 must show up as add_elsewhere().
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "tests/support/tier.h"

namespace helio::test {

// Probability of a false alarm of a whole family of tests.
inline constexpr double kSignificance = 0.01;

// Samples of a test. What a test resolves goes with their root: twice as much escapes the short tier. Sanitizers look
// at the code and not at its statistics.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline const int kChiSquareSamples = 100'000;
#else
inline const int kChiSquareSamples = by_tier(250'000, 1'000'000);
#endif

// Regularised incomplete gamma functions P(a, x) and Q(a, x) = 1 - P, for a > 0, x >= 0: power series below a + 1,
// Lentz's continued fraction above (Press et al., Numerical Recipes, 3rd edition, 6.2). Relative error below 1e-12 for
// a up to 1e5.
double regularized_gamma_p(double a, double x);
double regularized_gamma_q(double a, double x);

// Significance of one of `test_count` independent tests whose family has a false alarm with probability
// `family_significance` (Sidak 1967).
double sidak_significance(double family_significance, int test_count);

struct ChiSquareResult {
  double statistic = 0;
  int degrees_of_freedom = 0;
  double p_value = 1;      // of the whole test
  std::string impossible;  // what no statistic can excuse: a density above 1, samples of a density that is zero

  bool passes(double family_significance, int test_count) const {
    return impossible.empty() && p_value >= sidak_significance(family_significance, test_count);
  }
  std::string summary() const;
};

// Cells whose expectation is below `pool_below` are pooled, smallest first (cells of none included, whose samples so
// count against it), until the pool reaches it. Both arrays hold counts and have the same length; their sums must agree
// to within rounding for the p value to mean anything.
ChiSquareResult chi_square_test(const std::vector<double>& observed, const std::vector<double>& expected,
                                double pool_below = 5);

// Density per unit solid angle, at a unit vector.
using SphereDensity = std::function<double(const V3f&)>;

// The sphere as cells around an axis: polar angle theta with tan(theta / 2) = scale t / (1 - t), t and the azimuth cut
// into equal parts. A small scale (about the width of the lobe in radians) puts half of the cells where a narrow lobe
// is; scale 1 suits wide ones.
class SphereMap {
 public:
  SphereMap(const V3f& axis, double scale);

  // t in [0, 1), phi in [0, 1) turns.
  V3f direction(double t, double phi) const;
  // Solid angle per unit of t and phi.
  double jacobian(double t) const;
  void coordinates(const V3f& direction, double& t, double& phi) const;

 private:
  V3d s_, t_, n_;
  double scale_;
};

// Integral of `density` over the sphere, adaptively, absolute tolerance about `tolerance` for each of 24 x 48 cells.
double integrate_sphere(const SphereMap& map, const SphereDensity& density, double tolerance = 1e-7);

class SphereHistogram {
 public:
  explicit SphereHistogram(const V3f& axis, double scale = 1, int theta_cells = 24, int phi_cells = 48);

  void add(const V3f& direction);
  // A sample outside the density: invalid, or of a delta lobe.
  void add_elsewhere() { ++elsewhere_; }
  double share() const;  // of all samples, that the histogram counted

  // The mass of the density is kept for `mass` when it is not null.
  ChiSquareResult test(const SphereDensity& density, double* mass = nullptr) const;

 private:
  SphereMap map_;
  int theta_cells_, phi_cells_;
  std::vector<double> counts_;
  std::int64_t elsewhere_ = 0;
};

}  // namespace helio::test
