// Temporal reprojection of light into a preview: what an earlier picture shows of the same surface point, by one
// bilinear lookup whose taps must lie on that surface.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/preview/preview_history.h"
#include "renderer/preview/view_mapping.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class HistoryLookup {
 public:
  // `target`: of the picture that is made, whose surfaces are in history.current. The history outlives this.
  HistoryLookup(const PreviewView& target, PreviewHistory& history);

  // Light and samples of the window's pixels that have none. Surfaces of the window must be known. Thread safe for
  // different windows.
  void run(const PixelRect& window) const;
  // The same of one pixel of the film, wherever it is kept.
  void look_up(const PixelPosition& at, PreviewPixel& pixel) const { run_pixels(at.x, at.y, 1, &pixel); }

 private:
  struct Source {
    ViewMapping mapping;
    const PreviewPixel* pixels;
    PixelRect region;
    std::uint8_t most_samples;  // that a lookup counts for
  };
  struct Found {
    bool known = false;
    Rgb light{0, 0, 0};
    float samples = 0;  // 0: the light filled a gap there
  };
  void run_pixels(int x, int y, int count, PreviewPixel* pixels) const;
  // `to`: where the source shows the pixel.
  Found look(const Source& source, const ViewMapping::Point& to, const PreviewPixel& pixel, float slope) const;

  PreviewHistory& history_;
  static constexpr int kMostSources = 2;
  std::vector<Source> sources_;   // the one to prefer first
  CameraProjection here_;         // of the picture that is made
  V3f corner_, step_x_, step_y_;  // directions of its pixels, of length 1 along the view axis
};

}  // namespace helio
