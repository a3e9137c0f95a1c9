#include "renderer/trace/lights/ellipsoid_area.h"

#include <array>
#include <functional>

namespace helio {
namespace {

// The series below drop terms of sixth order in the relative spread of their arguments: 2e-16.
constexpr double kSpread = 2.5e-3;
// Squared semi-axis products are kept above this share of the largest: the area of a flatter one differs by 1e-13.
constexpr double kFlattest = 1e-14;

// Carlson's integrals by duplication (B. Carlson 1995, "Numerical computation of real or complex elliptic integrals";
// series: DLMF 19.36.1 and 19.36.2). Arguments > 0.
double carlson_rf(double x, double y, double z) {
  while (true) {
    const double mean = (x + y + z) / 3;
    const double a = 1 - x / mean, b = 1 - y / mean, c = -a - b;
    if (std::max({std::abs(a), std::abs(b), std::abs(c)}) < kSpread) {
      const double e2 = a * b - c * c, e3 = a * b * c;
      return (1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44) / std::sqrt(mean);
    }
    const double lambda = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
    x = (x + lambda) / 4;
    y = (y + lambda) / 4;
    z = (z + lambda) / 4;
  }
}

double carlson_rd(double x, double y, double z) {
  double sum = 0, power = 1;
  while (true) {
    const double mean = (x + y + 3 * z) / 5;
    const double a = 1 - x / mean, b = 1 - y / mean, c = -(a + b) / 3;
    if (std::max({std::abs(a), std::abs(b), std::abs(c)}) < kSpread) {
      const double ab = a * b, cc = c * c;
      const double e2 = ab - 6 * cc, e3 = (3 * ab - 8 * cc) * c, e4 = 3 * (ab - cc) * cc, e5 = ab * cc * c;
      const double series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26;
      return 3 * sum + power * series / (mean * std::sqrt(mean));
    }
    const double lambda = std::sqrt(x * y) + std::sqrt(y * z) + std::sqrt(z * x);
    sum += power / (std::sqrt(z) * (z + lambda));
    power /= 4;
    x = (x + lambda) / 4;
    y = (y + lambda) / 4;
    z = (z + lambda) / 4;
  }
}

// R_G (DLMF 19.21.10) of x >= z >= y > 0: in this order no term is negative, and none cancels another.
double carlson_rg(double x, double y, double z) {
  return 0.5 * (z * carlson_rf(x, y, z) - (x - z) * (y - z) * carlson_rd(x, y, z) / 3 + std::sqrt(x * (y / z)));
}

// Eigenvalues of the symmetric matrix with these rows, in descending order, by cyclic Jacobi rotations.
std::array<double, 3> eigenvalues(std::array<V3d, 3> m) {
  for (int sweep = 0; sweep < 12; ++sweep) {
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = m[k][p], kq = m[k][q];
          m[k][p] = c * kp - s * kq;
          m[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = m[p][k], qk = m[q][k];
          m[p][k] = c * pk - s * qk;
          m[q][k] = s * pk + c * qk;
        }
      }
    }
  }
  std::array<double, 3> values = {m[0][0], m[1][1], m[2][2]};
  std::sort(values.begin(), values.end(), std::greater<>());
  return values;
}

}  // namespace

EllipsoidArea ellipsoid_area(const V3d& e1, const V3d& e2, const V3d& e3) {
  const V3d c1 = cross(e2, e3), c2 = cross(e3, e1), c3 = cross(e1, e2);
  // In units of the largest cofactor, so that no square under- or overflows.
  double scale = 0;
  for (const V3d& c : {c1, c2, c3}) scale = std::max({scale, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
  if (!(scale > 0) || !is_finite(c1) || !is_finite(c2) || !is_finite(c3)) return {};
  const V3d a = c1 / scale, b = c2 / scale, c = c3 / scale;
  auto [most, middle, least] = eigenvalues({V3d(dot(a, a), dot(a, b), dot(a, c)), V3d(dot(b, a), dot(b, b), dot(b, c)),
                                            V3d(dot(c, a), dot(c, b), dot(c, c))});
  middle = std::max(middle, kFlattest * most);
  least = std::max(least, kFlattest * most);
  return {4 * std::numbers::pi * scale * carlson_rg(most, least, middle), scale * std::sqrt(most)};
}

}  // namespace helio
