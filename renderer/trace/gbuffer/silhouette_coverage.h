// What the rims of pixels show: their corners and the middles of their sides. Next to where two surfaces meet a pixel
// may show both, or one: where all eight points and the centre show the same surface, it is taken for the one that a
// box filter's samples see. What is smaller than half a pixel may hide between them, as it does between centres: where
// something shines next to a pixel nobody asks (Border::bright), for a sliver of a lamp is seen.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/gbuffer/surface_steps.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Thread safe once it is made.
class SilhouetteCoverage {
 public:
  // asked: row-major, of the window's pixels: those whose rims are traced.
  // axis: the camera's, unit.
  SilhouetteCoverage(const RenderScene& scene, const Camera& camera, const V3d& axis, const PixelRect& window,
                     const std::vector<std::uint8_t>& asked);

  // Whether the rim of a pixel that was asked for shows its centre's surface alone.
  bool show_only(const CentreHit& centre, int x, int y, SurfaceSteps& steps) const;
  std::uint64_t rays() const { return rays_; }

 private:
  static constexpr std::uint32_t kNotTraced = ~0u;

  // Points of half pixels: column 2 (x - x0) is at the left side of pixels x.
  std::size_t point(int column, int row) const {
    return std::size_t(row) * std::size_t(2 * window_.width() + 1) + std::size_t(column);
  }

  PixelRect window_;
  std::vector<std::uint32_t> slot_;  // of the points: in hits_
  std::vector<CentreHit> hits_;      // instance, normal and depth alone
  std::uint64_t rays_ = 0;
};

}  // namespace helio
