// A term of the variance's sums, made narrow.
#pragma once

#include <cfloat>

#include "renderer/film/core/lanes.h"

namespace helio {

// Terms are clamped so that 49 of them, times 25, stay finite, and so that a positive one stays positive.
inline void store_term(const Double4& term, float last, float* out) {
  constexpr double kLargestTerm = 1e34;
  const Double4 low = Double4{} + double(FLT_MIN), high = Double4{} + kLargestTerm;
  Double4 clamped = term < low ? low : term;
  clamped = clamped > high ? high : clamped;
  clamped = term > 0.0 ? clamped : Double4{};
  Float4 narrow = __builtin_convertvector(clamped, Float4);
  narrow[3] = last;
  store(narrow, out);
}

}  // namespace helio
