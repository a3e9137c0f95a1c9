// How long a view will be rendered yet, by what has been rendered of it.
#pragma once

#include <optional>
#include <vector>

#include "renderer/frame/frame_sink.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// How the error of one view falls.
class ErrorCurve {
 public:
  struct Point {
    double samples = 0;  // per pixel
    double error = 0;    // standard error, with what may hide in black, > 0
  };

  // Of the newest estimate; each is added once.
  void add(const FrameProgress& progress);
  const std::vector<Point>& points() const { return points_; }

 private:
  static constexpr std::size_t kMostPoints = 64;  // the oldest go first

  std::vector<Point> points_;
};

struct TimeLeft {
  double seconds = 0;
  double low_s = 0, high_s = 0;  // hold the end in 4 of 5 views
};

// Until the first of the budget's ends is reached, at the rate of samples so far. Nothing: no end is in sight, or fewer
// than 16 samples a pixel tell of none. A target error: the error falls as samples^-p; p is the usual exponent, corrected
// by the curve. pixels: that are rendered, > 0.
std::optional<TimeLeft> time_left(const FrameProgress& progress, double pixels, const Budget& budget,
                                  const ErrorCurve& curve);

}  // namespace helio
