// Ranges that numbers of settings lie in, and the words that messages give them.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>

namespace helio {

// Nine digits, whole numbers in full.
inline std::string number_text(double value) {
  char buffer[32];
  const bool whole = std::fabs(value) < 9007199254740992.0 && value == std::floor(value);
  std::snprintf(buffer, sizeof buffer, whole ? "%.0f" : "%.9g", value);
  return buffer;
}

struct NumberRange {
  double low = 0, high = 0;  // high is part of it
  bool low_included = true;

  // False for NaN.
  bool contains(double value) const { return (low_included ? value >= low : value > low) && value <= high; }
  bool bounded() const { return high < std::numeric_limits<double>::max(); }
  // "[1, 64]", "(0, inf)"
  std::string to_string() const {
    std::string text = low_included && low > -std::numeric_limits<double>::max() ? "[" : "(";
    text += low > -std::numeric_limits<double>::max() ? number_text(low) : "-inf";
    text += ", ";
    text += bounded() ? number_text(high) : "inf";
    return text += bounded() ? ']' : ')';
  }
};

inline constexpr NumberRange kAnyNumber{-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
inline constexpr NumberRange kPositiveNumber{0, std::numeric_limits<double>::max(), false};
inline constexpr NumberRange kSampleBudget{1, 1u << 30};  // samples per pixel that a budget may ask for
inline constexpr NumberRange kExposureStops{-64, 64};

}  // namespace helio
