// Whether what two points of a film show is one surface without a step: a leaf and the one behind it are of one
// instance and may face the same way.
#pragma once

#include <algorithm>
#include <cmath>

#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera_projection.h"

namespace helio {

// Not thread safe: keeps what it worked out last.
class SurfaceSteps {
 public:
  // projection: of the camera that sees them.
  explicit SurfaceSteps(const CameraProjection& projection) : projection_(projection) {}

  // Points of the film in pixels: same_surface(), and no step between the two.
  bool one_surface(const CentreHit& here, double x, double y, const CentreHit& there, double there_x, double there_y) {
    return same_surface(here, there) && !between(here, x, y, there, there_x, there_y);
  }

 private:
  // More than a pixel's side, as large as it is there, for every pixel between the two, off the planes through both.
  bool between(const CentreHit& here, double x, double y, const CentreHit& there, double there_x, double there_y) {
    if (!here.hit() || !there.hit()) return false;
    const double apart = std::max({1.0, std::fabs(there_x - x), std::fabs(there_y - y)});
    const double most = apart * projection_.footprint(double(here.depth));
    const auto off = [&](std::uint32_t normal) {
      if (!known_ || normal != normal_) {
        heights_ = projection_.heights_along(V3d(unpack_direction(normal)));
        normal_ = normal;
        known_ = true;
      }
      return std::fabs(heights_.at(there_x, there_y, double(there.depth)) - heights_.at(x, y, double(here.depth)));
    };
    return !(off(here.normal) <= most) && !(there.normal != here.normal && off(there.normal) <= most);
  }

  const CameraProjection& projection_;
  bool known_ = false;
  std::uint32_t normal_ = 0;
  CameraProjection::Heights heights_;
};

}  // namespace helio
