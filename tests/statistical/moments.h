// Mean of independent values, and what it is known to.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace helio::test {

struct Moments {
  double sum = 0, squares = 0, n = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    ++n;
  }
  double mean() const { return sum / n; }
  double variance_of_mean() const { return std::max(0.0, squares / n - mean() * mean()) / (n - 1); }
};

// The root of a sum over another, and its standard error from the seeds that make them (jackknife: each left out once).
class RootOfRatio {
 public:
  void add(double numerator, double denominator) { terms_.emplace_back(numerator, denominator); }
  double value() const { return without(terms_.size()); }
  double error() const {
    Moments left_out;
    for (std::size_t i = 0; i < terms_.size(); ++i) left_out.add(without(i));
    const auto n = double(terms_.size());
    return (n - 1) * std::sqrt(left_out.variance_of_mean());
  }

 private:
  double without(std::size_t skipped) const {
    double numerator = 0, denominator = 0;
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      if (i == skipped) continue;
      numerator += terms_[i].first;
      denominator += terms_[i].second;
    }
    return std::sqrt(numerator / denominator);
  }

  std::vector<std::pair<double, double>> terms_;
};

}  // namespace helio::test
