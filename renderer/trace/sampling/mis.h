// Weights that combine sampling techniques.
#pragma once

namespace helio {

// Balance of two techniques by the power heuristic with exponent 2 (Veach 1997, eq. 9.13): weight of the first.
// Densities may be as large as 1e30, so that their ratio is squared, not they. `pdf` > 0.
inline float mis_weight(float pdf, float other) {
  const float ratio = other / pdf;
  return 1 / (1 + ratio * ratio);
}

}  // namespace helio
