// What later pictures have to know of one before they can draw on it: what the centres of its pixels meet, and which of
// them may show another surface, too. A picture that drew on others knows it from the start, for that is how it found
// them (trace/reuse/reprojection.h); of one that began from nothing it can be found out at any time.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// How far a filter reaches, in pixels from a pixel's centre to the centres of others, at least one.
int filter_reach(const PixelFilter& filter);

// Three sweeps over windows of a film, to be shared between threads: find() of every window, then find_borders() of
// every window, then settle(). Windows are disjoint and lie in the region. What is returned is rays that were traced.
class GbufferPass {
 public:
  // The film, which must have history with sources, outlives this.
  GbufferPass(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region, const CameraPose& pose,
              const PixelFilter& filter);

  // What centres meet (FilmHistory::centre).
  std::uint64_t find(const PixelRect& window);
  // Finds what is next to another surface and notes it (CarriedPixel::found).
  std::uint64_t find_borders(const PixelRect& window);
  // Moves that to where it belongs (CentreHit::border).
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
  bool box_;  // the filter reaches no other pixel in truth
};

}  // namespace helio
