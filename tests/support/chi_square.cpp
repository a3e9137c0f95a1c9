#include "tests/support/chi_square.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace helio::test {

namespace {

constexpr double kPiD = std::numbers::pi;
constexpr int kMaxIterations = 1'000'000;

double log_prefactor(double a, double x) {
  return -x + a * std::log(x) - std::lgamma(a);
}

double gamma_p_series(double a, double x) {
  double term = 1 / a, sum = term;
  for (int n = 1; n < kMaxIterations; ++n) {
    term *= x / (a + n);
    sum += term;
    if (term < sum * std::numeric_limits<double>::epsilon()) break;
  }
  return sum * std::exp(log_prefactor(a, x));
}

double gamma_q_fraction(double a, double x) {
  constexpr double kTiny = std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon();
  double b = x + 1 - a, c = 1 / kTiny, d = 1 / b, h = d;
  for (int n = 1; n < kMaxIterations; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    if (std::fabs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::fabs(c) < kTiny) c = kTiny;
    d = 1 / d;
    const double delta = d * c;
    h *= delta;
    if (std::fabs(delta - 1) <= std::numeric_limits<double>::epsilon()) break;
  }
  return h * std::exp(log_prefactor(a, x));
}

void check_gamma_arguments(double a, double x) {
  if (!(a > 0) || !(x >= 0)) throw std::domain_error("incomplete gamma function: needs a > 0 and x >= 0");
}

// Integral over a rectangle of (t, phi) by 3 x 3 Gauss-Legendre points.
double gauss_cell(const SphereMap& map, const SphereDensity& density, double t0, double t1, double p0, double p1) {
  constexpr double kNode[3] = {-0.774596669241483377, 0, 0.774596669241483377};
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double t = 0.5 * (t0 + t1) + 0.5 * (t1 - t0) * kNode[i];
    const double row_weight = kWeight[i] * map.jacobian(t);
    for (int j = 0; j < 3; ++j) {
      const double phi = 0.5 * (p0 + p1) + 0.5 * (p1 - p0) * kNode[j];
      sum += row_weight * kWeight[j] * density(map.direction(t, phi));
    }
  }
  return sum * (t1 - t0) * (p1 - p0);
}

double integrate_cell(const SphereMap& map, const SphereDensity& density, double t0, double t1, double p0, double p1,
                      double coarse, double tolerance, int depth) {
  const double tm = 0.5 * (t0 + t1), pm = 0.5 * (p0 + p1);
  const double a = gauss_cell(map, density, t0, tm, p0, pm), b = gauss_cell(map, density, tm, t1, p0, pm);
  const double c = gauss_cell(map, density, t0, tm, pm, p1), d = gauss_cell(map, density, tm, t1, pm, p1);
  const double fine = a + b + c + d;
  if (depth == 0 || std::fabs(fine - coarse) < tolerance) return fine;
  const double next = tolerance * 0.5;
  return integrate_cell(map, density, t0, tm, p0, pm, a, next, depth - 1) +
         integrate_cell(map, density, tm, t1, p0, pm, b, next, depth - 1) +
         integrate_cell(map, density, t0, tm, pm, p1, c, next, depth - 1) +
         integrate_cell(map, density, tm, t1, pm, p1, d, next, depth - 1);
}

double integrate_cell(const SphereMap& map, const SphereDensity& density, double t0, double t1, double p0, double p1,
                      double tolerance) {
  constexpr int kMaxDepth = 9;
  const double coarse = gauss_cell(map, density, t0, t1, p0, p1);
  return integrate_cell(map, density, t0, t1, p0, p1, coarse, tolerance, kMaxDepth);
}

}  // namespace

double regularized_gamma_p(double a, double x) {
  check_gamma_arguments(a, x);
  if (x == 0) return 0;
  return x < a + 1 ? gamma_p_series(a, x) : 1 - gamma_q_fraction(a, x);
}

double regularized_gamma_q(double a, double x) {
  check_gamma_arguments(a, x);
  if (x == 0) return 1;
  return x < a + 1 ? 1 - gamma_p_series(a, x) : gamma_q_fraction(a, x);
}

double sidak_significance(double family_significance, int test_count) {
  return -std::expm1(std::log1p(-family_significance) / test_count);
}

std::string ChiSquareResult::summary() const {
  std::ostringstream out;
  out << "chi-square " << statistic << " with " << degrees_of_freedom << " degrees of freedom, p = " << p_value;
  if (!impossible.empty()) out << "; " << impossible;
  return out.str();
}

ChiSquareResult chi_square_test(const std::vector<double>& observed, const std::vector<double>& expected,
                                double pool_below) {
  if (observed.size() != expected.size()) throw std::invalid_argument("chi_square_test: arrays differ in length");
  ChiSquareResult result;
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return expected[a] < expected[b]; });

  int cells = 0;
  double pooled_observed = 0, pooled_expected = 0;
  for (const std::size_t i : order) {
    if (expected[i] <= 0) {
      if (observed[i] > 0 && result.impossible.empty()) {
        std::ostringstream out;
        out << observed[i] << " samples in cell " << i << ", whose expectation is " << expected[i];
        result.impossible = out.str();
      }
      continue;
    }
    pooled_observed += observed[i];
    pooled_expected += expected[i];
    if (pooled_expected < pool_below) continue;
    const double difference = pooled_observed - pooled_expected;
    result.statistic += difference * difference / pooled_expected;
    ++cells;
    pooled_observed = pooled_expected = 0;
  }
  // Only a total expectation below `pool_below` leaves a pool behind: the cells come in growing order.
  result.degrees_of_freedom = std::max(0, cells - 1);
  if (result.degrees_of_freedom > 0) {
    result.p_value = regularized_gamma_q(0.5 * result.degrees_of_freedom, 0.5 * result.statistic);
  }
  return result;
}

SphereMap::SphereMap(const V3f& axis, double scale) : n_(V3d(axis).normalized()), scale_(scale) {
  s_ = std::fabs(n_.x) > 0.6 ? V3d(0, 1, 0) : V3d(1, 0, 0);
  s_ = (s_ - n_ * n_.dot(s_)).normalized();
  t_ = n_.cross(s_);
}

V3f SphereMap::direction(double t, double phi) const {
  const double q = 1 - t, y = scale_ * t;
  const double norm = q * q + y * y;
  const double sin_theta = 2 * y * q / norm, cos_theta = (q * q - y * y) / norm;
  const double angle = 2 * kPiD * phi;
  return V3f(s_ * (sin_theta * std::cos(angle)) + t_ * (sin_theta * std::sin(angle)) + n_ * cos_theta);
}

double SphereMap::jacobian(double t) const {
  const double q = 1 - t, y = scale_ * t;
  const double norm = q * q + y * y;
  const double sin_theta = 2 * y * q / norm, dtheta_dt = 2 * scale_ / norm;
  return 2 * kPiD * sin_theta * dtheta_dt;
}

void SphereMap::coordinates(const V3f& direction, double& t, double& phi) const {
  const V3d d = V3d(direction).normalized();
  const double x = s_.dot(d), y = t_.dot(d), z = n_.dot(d);
  const double r = std::hypot(x, y);
  // 1 + z without cancellation where the direction is opposite to the axis.
  const double one_plus_z = z > 0 ? 1 + z : r * r / (1 - z);
  const double sum = r + scale_ * one_plus_z;
  t = sum > 0 ? r / sum : 1;
  phi = std::atan2(y, x) / (2 * kPiD);
  if (phi < 0) phi += 1;
}

double integrate_sphere(const SphereMap& map, const SphereDensity& density, double tolerance) {
  constexpr int kTheta = 24, kPhi = 48;
  double sum = 0;
  for (int i = 0; i < kTheta; ++i) {
    for (int j = 0; j < kPhi; ++j) {
      sum += integrate_cell(map, density, double(i) / kTheta, double(i + 1) / kTheta, double(j) / kPhi,
                            double(j + 1) / kPhi, tolerance);
    }
  }
  return sum;
}

SphereHistogram::SphereHistogram(const V3f& axis, double scale, int theta_cells, int phi_cells)
    : map_(axis, scale),
      theta_cells_(theta_cells),
      phi_cells_(phi_cells),
      counts_(static_cast<std::size_t>(theta_cells) * phi_cells) {}

void SphereHistogram::add(const V3f& direction) {
  double t, phi;
  map_.coordinates(direction, t, phi);
  const int i = std::min(theta_cells_ - 1, static_cast<int>(t * theta_cells_));
  const int j = std::min(phi_cells_ - 1, static_cast<int>(phi * phi_cells_));
  counts_[static_cast<std::size_t>(i) * phi_cells_ + j] += 1;
}

ChiSquareResult SphereHistogram::test(const SphereDensity& density, double* mass) const {
  std::vector<double> observed = counts_, expected;
  observed.push_back(static_cast<double>(elsewhere_));
  const double samples = std::accumulate(observed.begin(), observed.end(), 0.0);
  // A cell's integral may be wrong by a small part of the count's own deviation, which is about 1 at least.
  const double tolerance = 0.05 / std::max(1.0, samples);
  expected.reserve(observed.size());
  double sum = 0;
  for (int i = 0; i < theta_cells_; ++i) {
    for (int j = 0; j < phi_cells_; ++j) {
      const double cell = integrate_cell(map_, density, double(i) / theta_cells_, double(i + 1) / theta_cells_,
                                         double(j) / phi_cells_, double(j + 1) / phi_cells_, tolerance);
      sum += cell;
      expected.push_back(cell * samples);
    }
  }
  if (mass != nullptr) *mass = sum;
  // Integration error alone may bring the mass a little above 1: such a remainder is none.
  const double rest = 1 - sum;
  constexpr double kMassTolerance = 2e-4;
  expected.push_back(std::fabs(rest) < kMassTolerance && elsewhere_ == 0 ? 0 : std::max(0.0, rest) * samples);
  ChiSquareResult result = chi_square_test(observed, expected);
  if (rest < -kMassTolerance) {
    std::ostringstream out;
    out << "the density integrates to " << sum << ", above 1";
    result.impossible += (result.impossible.empty() ? "" : "; ") + out.str();
  }
  return result;
}

}  // namespace helio::test
