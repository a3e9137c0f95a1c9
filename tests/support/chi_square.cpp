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

// Cells are halved at most this often; and at least so that a band a sixteenth as wide as a cell is seen, in the short
// tier an eighth: each halving takes four times as many densities.
constexpr int kMaxDepth = 9;
const int kFirstSettledDepth = kMaxDepth - by_tier(1, 2);

struct Cell {
  double t0, t1, p0, p1;

  double area() const { return (t1 - t0) * (p1 - p0); }
};

struct CellIntegral {
  double value = 0;
  double largest = 0;  // of the integrand, at the points looked at
  bool edge = false;   // the density is zero at some of them only: a horizon or a critical angle passes
};

// 3 x 3 Gauss-Legendre points; the corners are looked at too, since a horizon may cut off less than the nodes see.
CellIntegral gauss_cell(const SphereMap& map, const SphereDensity& density, const Cell& cell) {
  constexpr double kNode[5] = {-0.774596669241483377, 0, 0.774596669241483377, -1, 1};
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  CellIntegral result;
  bool any_zero = false;
  const auto integrand = [&](int i, int j) {
    const double t = 0.5 * (cell.t0 + cell.t1) + 0.5 * (cell.t1 - cell.t0) * kNode[i];
    const double phi = 0.5 * (cell.p0 + cell.p1) + 0.5 * (cell.p1 - cell.p0) * kNode[j];
    const double d = density(map.direction(t, phi)), value = d * map.jacobian(t);
    any_zero |= d == 0;
    result.largest = std::max(result.largest, value);
    return value;
  };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result.value += kWeight[i] * kWeight[j] * integrand(i, j);
  }
  for (int i = 3; i < 5; ++i) {
    for (int j = 3; j < 5; ++j) integrand(i, j);
  }
  result.value *= cell.area();
  result.edge = any_zero && result.largest > 0;
  return result;
}

double integrate_cell(const SphereMap& map, const SphereDensity& density, const Cell& cell, const CellIntegral& coarse,
                      double tolerance, int depth) {
  const double tm = 0.5 * (cell.t0 + cell.t1), pm = 0.5 * (cell.p0 + cell.p1);
  const Cell quarters[4] = {
      {cell.t0, tm, cell.p0, pm}, {tm, cell.t1, cell.p0, pm}, {cell.t0, tm, pm, cell.p1}, {tm, cell.t1, pm, cell.p1}};
  CellIntegral fine[4];
  double sum = 0, largest = coarse.largest;
  bool edge = coarse.edge;
  for (int i = 0; i < 4; ++i) {
    fine[i] = gauss_cell(map, density, quarters[i]);
    sum += fine[i].value;
    largest = std::max(largest, fine[i].largest);
    edge |= fine[i].edge;
  }
  const bool settled = edge ? largest * cell.area() < tolerance : std::fabs(sum - coarse.value) < tolerance;
  if (depth == 0 || (settled && depth <= kFirstSettledDepth)) return sum;
  double refined = 0;
  for (int i = 0; i < 4; ++i) {
    refined += integrate_cell(map, density, quarters[i], fine[i], edge ? tolerance : 0.5 * tolerance, depth - 1);
  }
  return refined;
}

double integrate_cell(const SphereMap& map, const SphereDensity& density, const Cell& cell, double tolerance) {
  return integrate_cell(map, density, cell, gauss_cell(map, density, cell), tolerance, kMaxDepth);
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
    pooled_observed += observed[i];
    pooled_expected += std::max(0.0, expected[i]);
    if (pooled_expected < pool_below) continue;
    const double difference = pooled_observed - pooled_expected;
    result.statistic += difference * difference / pooled_expected;
    ++cells;
    pooled_observed = pooled_expected = 0;
  }
  // The cells come in growing order: a pool is left over only where there was no cell of `pool_below` at all.
  if (cells == 0 && pooled_observed > 0 && pooled_expected <= 0) {
    result.impossible = "samples where the density is zero";
  }
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
      const Cell cell{double(i) / kTheta, double(i + 1) / kTheta, double(j) / kPhi, double(j + 1) / kPhi};
      sum += integrate_cell(map, density, cell, tolerance);
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

double SphereHistogram::share() const {
  const double counted = std::accumulate(counts_.begin(), counts_.end(), 0.0);
  return counted / (counted + static_cast<double>(elsewhere_));
}

ChiSquareResult SphereHistogram::test(const SphereDensity& density, double* mass) const {
  std::vector<double> observed = counts_, expected;
  observed.push_back(static_cast<double>(elsewhere_));
  const double samples = std::accumulate(observed.begin(), observed.end(), 0.0);
  // A cell's integral may be wrong by a small part of the deviation of a count that is not pooled; of few samples by no
  // more than of these, for a cell that a narrow band crosses settles too early at a coarse tolerance.
  constexpr double kFewSamples = 125'000;
  const double tolerance = 0.2 / std::max(kFewSamples, samples);
  expected.reserve(observed.size());
  double sum = 0;
  for (int i = 0; i < theta_cells_; ++i) {
    for (int j = 0; j < phi_cells_; ++j) {
      const Cell bounds{double(i) / theta_cells_, double(i + 1) / theta_cells_, double(j) / phi_cells_,
                        double(j + 1) / phi_cells_};
      const double cell = integrate_cell(map_, density, bounds, tolerance);
      sum += cell;
      expected.push_back(cell * samples);
    }
  }
  if (mass != nullptr) *mass = sum;
  // Integration error alone may bring the mass a little above 1: such a remainder is none.
  const double rest = 1 - sum;
  const double mass_tolerance = std::max(2e-4, tolerance * static_cast<double>(counts_.size()));
  expected.push_back(std::fabs(rest) < mass_tolerance && elsewhere_ == 0 ? 0 : std::max(0.0, rest) * samples);
  ChiSquareResult result = chi_square_test(observed, expected);
  if (rest < -mass_tolerance) {
    std::ostringstream out;
    out << "the density integrates to " << sum << ", above 1";
    result.impossible += (result.impossible.empty() ? "" : "; ") + out.str();
  }
  return result;
}

}  // namespace helio::test
