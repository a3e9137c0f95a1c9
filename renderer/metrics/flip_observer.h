// What FLIP's observer sees of a picture: colours in CIELAB with the Hunt effect, and the strength of edges and points.
#pragma once

#include <vector>

#include "renderer/metrics/flip_filter.h"

namespace helio {

// One row, as many values each as the picture is wide.
struct ObservedRow {
  const float *l = nullptr, *a = nullptr, *b = nullptr;  // filtered by contrast sensitivity, in the display's range
  const float *edge = nullptr, *point = nullptr;         // as of FlipFilter::Row
};

class FlipObserver {
 public:
  FlipObserver(const FlipKernels& kernels, int width, int height);

  // As of FlipFilter::row; valid until the next call.
  ObservedRow row(int y, const FlipRows& rows);

 private:
  std::size_t width_;
  FlipFilter filter_;
  std::vector<float> l_, a_, b_;
};

}  // namespace helio
