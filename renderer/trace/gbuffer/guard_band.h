// What is beside a picture: it ends there, the light of the pixels at its edge does not. Beside a region that is what
// the filters of its pixels reach. Beside the film, where filters are cut off, it is what the first centres out there
// show: surfaces that end between them and the outermost ones inside are seen by those pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/trace/gbuffer/primary_hits.h"

namespace helio {

// Centre hits outside a region, as far as a window's pixels have to know them. Thread safe once it is made.
class GuardBand {
 public:
  // window: inside the region. reach: of the filter, in pixels, at least 1. axis: the camera's, unit.
  GuardBand(const RenderScene& scene, const Camera& camera, const V3d& axis, const PixelRect& window, int reach,
            const PixelRect& region);

  // Of a pixel outside the region and inside bounds().
  const CentreHit& at(int x, int y) const { return hits_[index(x, y)]; }
  // The window, and what counts for its pixels, inside the region and outside.
  const PixelRect& bounds() const { return bounds_; }
  // That were traced; 0: the window is not at the region's edge.
  std::uint64_t rays() const { return rays_; }

 private:
  std::size_t index(int x, int y) const {
    return std::size_t(y - bounds_.y0) * std::size_t(bounds_.width()) + std::size_t(x - bounds_.x0);
  }

  PixelRect bounds_;
  std::vector<CentreHit> hits_;  // those outside the region; empty: there are none
  std::uint64_t rays_ = 0;
};

}  // namespace helio
