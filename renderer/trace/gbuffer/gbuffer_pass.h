// G-buffer of a film for reprojection: the primary hit of the ray through each pixel's centre, and which pixels may
// show another surface, too. Every picture that later ones may draw on has it from the start
// (trace/reuse/reprojection.h).
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// How far a filter reaches, in pixels from a pixel's centre to the centres of others, at least one.
int filter_reach(const PixelFilter& filter);

// Over windows of a film whose centres are known (FilmHistory::centre), to be shared between threads: find_borders() of
// every window, then settle(). Windows are disjoint and lie in the region.
class GbufferPass {
 public:
  // The film, which must have history with sources, outlives this.
  GbufferPass(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region, const CameraPose& pose,
              const PixelFilter& filter);

  // Notes the pixels that border another surface in CarriedPixel::found(). Returns the rays that it traced.
  std::uint64_t find_borders(const PixelRect& window);
  // Copies those notes to CentreHit::border.
  void settle(const PixelRect& window);

  const RenderScene& scene() const { return *scene_; }
  const CameraPose& pose() const { return pose_; }
  const Camera& camera() const { return camera_; }
  const PixelRect& region() const { return region_; }
  // Pixels around that a pixel's filter reaches.
  int reach() const { return reach_; }
  PixelRect reached_from(int x, int y) const { return {x - reach_, y - reach_, x + reach_ + 1, y + reach_ + 1}; }

 private:
  std::shared_ptr<const RenderScene> scene_;
  Film& film_;
  PixelRect region_;
  CameraPose pose_;
  Camera camera_;
  int reach_;
  bool box_;  // filter_reach() says 1, but it never samples outside of the pixel
};

}  // namespace helio
