// Visibility without a ray for every pixel: a lattice of rays, refined where it meets edges, and what lies between
// interpolated.
//
// Rays go to every fourth pixel along either axis. A cell of the lattice whose corners lie on one flat piece of a
// surface is done once it is two pixels wide; others are halved, and edges are traced pixel by pixel. The
// lattice moves from preview to preview, so that every pixel has a ray of its own in turn: in between its colour comes
// from the preview before, where that shows the same surface (temporal upsampling; Yang et al. 2020), else from the
// corners. What is thinner than a cell is not lost between rays once it was met: a pixel before which the preview
// before shows something nearer is traced.
#pragma once

#include <cstdint>
#include <optional>

#include "renderer/preview/preview_history.h"
#include "renderer/preview/surface_pass.h"
#include "renderer/preview/view_mapping.h"

namespace helio {

class SparseSurfaces {
 public:
  // before: surfaces of the preview before, of the same scene, whose colours are history.colors_before; null: unknown.
  // All outlive this.
  SparseSurfaces(const SurfacePass& surfaces, const PreviewView& view, const PreviewBuffer* before,
                 PreviewHistory& history);

  // Pixels of a window: as SurfacePass::run(). Thread safe for different windows. Returns the rays traced.
  std::uint64_t run(const PixelRect& window) const;

 private:
  struct Window;
  struct Cell;
  bool flat(const Window& window, const Cell& cell) const;
  void fill(Window& window, const Cell& cell) const;
  void take_colors(Window& window) const;
  V3f point(int x, int y, float depth) const;
  void trace(Window& window) const;

  const SurfacePass& surfaces_;
  const PixelRect region_;
  const PreviewBuffer* const before_;
  PreviewHistory& history_;
  int offset_x_, offset_y_;  // of the lattice
  CameraProjection here_;
  V3f corner_, step_x_, step_y_, along_;  // point() is affine in the pixel, times the depth but for orthographic views
  std::optional<ViewMapping> to_before_;
};

}  // namespace helio
