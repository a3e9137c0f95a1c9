// Random errors of known distributions, for tests that simulate seeds.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/random.h"

namespace helio::test {

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}

  double uniform() { return 1 - random_.next_double(); }  // (0, 1]
  double normal() { return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform()); }
  double normal(double mean, double deviation) { return mean + deviation * normal(); }
  double log_normal(double sigma) { return std::exp(sigma * normal()); }
  double pareto(double exponent) { return std::pow(uniform(), -1 / exponent); }  // at least 1

 private:
  Random random_;
};

template <class Draw>
std::vector<double> draw_many(int count, const Draw& draw) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(draw());
  return values;
}

}  // namespace helio::test
