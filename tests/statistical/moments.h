// Mean of independent values, and what it is known to.
#pragma once

#include <algorithm>

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

}  // namespace helio::test
