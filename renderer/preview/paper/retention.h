// How much of a new picture temporal anti-aliasing takes, and where in their pixels its samples lie (Mrad 2022, sections
// 4.3.2 and 4.4).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace helio {

// Pictures a second as the heuristic takes them. As published, eq. 4.7 weighs the newest picture with 0.1 and the one
// before with 0.9, and forgets all others.
class PictureRate {
 public:
  static constexpr double kUnknown = 60;

  // A picture took so many seconds, > 0. mean: the rate before in place of that of the picture before.
  void add(double seconds, bool mean) {
    const double rate = 1 / std::max(seconds, 1e-6);
    value_ = known_ ? 0.1 * rate + 0.9 * (mean ? value_ : newest_) : rate;
    newest_ = rate;
    known_ = true;
  }
  double value() const { return value_; }  // > 0

 private:
  bool known_ = false;
  double value_ = kUnknown, newest_ = kUnknown;
};

// Eq. 4.8. motion: of a pixel, over the picture's diagonal, >= 0.
inline double motion_heuristic(double motion, double rate) {
  return std::sqrt(std::sqrt(motion)) * 60 / rate;
}

// Share of the new colour, [0.1, 1]: eq. 4.10. difference: of the new colours and those of the history around the pixel,
// eq. 4.9, in units in which a picture reaches from 0 to 1.
inline double retention(double difference, double heuristic) {
  const double least = std::clamp(difference, 0.1, 1.0);
  return least + std::clamp((1 - least) * heuristic, 0.0, 1 - least);
}

// Of a Halton sequence, [0, 1). index > 0.
inline double radical_inverse(std::uint32_t index, std::uint32_t base) {
  double value = 0, digit = 1.0 / base;
  for (; index > 0; index /= base, digit /= base) value += digit * (index % base);
  return value;
}

struct SubpixelJitter {
  double x = 0, y = 0;  // from the pixel's centre, [-0.5, 0.5)
};
// Of the picture with this number. ratio: sides of the picture shown over those of the one that is rendered, >= 1; the
// sequence has 16 ceil(ratio^2) elements.
inline SubpixelJitter subpixel_jitter(std::uint32_t picture, double ratio) {
  const std::uint32_t phase = 16 * std::uint32_t(std::ceil(ratio * ratio - 1e-9));
  const std::uint32_t index = 1 + picture % phase;
  return {radical_inverse(index, 2) - 0.5, radical_inverse(index, 3) - 0.5};
}

}  // namespace helio
