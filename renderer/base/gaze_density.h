// Where somebody looks, and how densely a picture is worth sampling around that point.
//
// Acuity falls about as 1 / (1 + e / e2) with the angle e from the gaze (linear minimum angle of resolution: Weymouth
// 1958, Strasburger et al. 2011, eq. 1; e2 is about 2.3 degrees for cortical magnification), so that samples an area
// fall as its square. Within kFoveaDegrees of the gaze the density is 1, for eyes move and a gaze is known late; far
// outside it is kLeastDensity, for nobody may notice what happens there if nothing is rendered.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "renderer/base/math.h"

namespace helio {

// A point of the film, pixels from its upper left corner; off the film as well.
struct Gaze {
  double x = 0, y = 0;

  bool operator==(const Gaze&) const = default;
};

inline constexpr double kMostGazePixels = 1e6;  // from the corner, either way

class GazeDensity {
 public:
  static constexpr double kFoveaDegrees = 5, kHalvingDegrees = 2.3;  // e2, counted from the edge of the fovea
  static constexpr double kLeastDensity = 1.0 / 64;

  // Eye in front of the gaze, `distance` heights of the picture away, (0, +inf).
  GazeDensity(const Gaze& gaze, int film_height, double distance)
      : x_(float(gaze.x)), y_(float(gaze.y)) {
    const double pixels = distance * film_height;
    const double farthest = kFoveaDegrees + kHalvingDegrees * (1 / std::sqrt(kLeastDensity) - 1);
    radius_ = pixels * std::tan(farthest * kRadians);
    step_ = float(kEntries / radius_);
    for (std::size_t i = 0; i < log_.size(); ++i) {
      const double degrees = std::atan(radius_ * double(i) / (kEntries * pixels)) / kRadians;
      const double beyond = std::max(degrees - kFoveaDegrees, 0.0) / kHalvingDegrees;
      log_[i] = float(std::max(-2 * std::log2(1 + beyond), std::log2(kLeastDensity)));
    }
  }

  // log2 of the density at a point of the film, [log2(kLeastDensity), 0]; continuous, and falls with the distance.
  float log_at(float x, float y) const {
    const float dx = x - x_, dy = y - y_;
    const float at = std::sqrt(dx * dx + dy * dy) * step_;
    if (!(at < float(kEntries))) return log_.back();
    const auto i = std::size_t(at);
    return log_[i] + (log_[i + 1] - log_[i]) * (at - float(i));
  }
  float at(float x, float y) const { return std::exp2(log_at(x, y)); }
  // The largest within a window.
  float most_in(const PixelRect& window) const {
    return at(std::clamp(x_, float(window.x0), float(window.x1)), std::clamp(y_, float(window.y0), float(window.y1)));
  }
  // Of the density, or of `least` where that is more, over a region, to about a percent.
  double mean_over(const PixelRect& region, double least = 0) const {
    constexpr int kPoints = 96;  // along either side
    double sum = 0;
    for (int j = 0; j < kPoints; ++j) {
      for (int i = 0; i < kPoints; ++i)
        sum += std::max(double(at(float(region.x0 + (i + 0.5) * region.width() / kPoints),
                                  float(region.y0 + (j + 0.5) * region.height() / kPoints))),
                        least);
    }
    return sum / (kPoints * kPoints);
  }
  double radius() const { return radius_; }  // pixels from the gaze from which on the density is kLeastDensity

 private:
  static constexpr double kRadians = std::numbers::pi / 180;
  static constexpr std::size_t kEntries = 256;

  float x_, y_, step_ = 0;
  double radius_ = 0;
  std::array<float, kEntries + 1> log_{};
};

}  // namespace helio
