// Visibility and light of a preview at the density that a gaze asks for: a ray and a lookup for every pixel, or for
// blocks of 2x2 or 4x4 pixels that show the same.
#pragma once

#include <cstdint>

#include "renderer/base/gaze_density.h"
#include "renderer/preview/history_lookup.h"
#include "renderer/preview/preview_history.h"
#include "renderer/preview/sparse_surfaces.h"
#include "renderer/preview/surface_pass.h"

namespace helio {

class CoarseSurfaces {
 public:
  // From which density on blocks are of one pixel, and of 2x2.
  static constexpr float kFullDensity = 0.25f, kHalfDensity = 1.0f / 16;

  // sparse: with upscaling, what traces parts of full density; null: every pixel. All outlive this.
  CoarseSurfaces(const SurfacePass& surfaces, const SparseSurfaces* sparse, const HistoryLookup& lookup,
                 PreviewHistory& history)
      : surfaces_(surfaces), sparse_(sparse), lookup_(lookup), history_(history) {}

  // Pixels of a part of the picture, aligned to kPathGroupSize: surfaces as SurfacePass::run(), light as
  // HistoryLookup::run(). Thread safe for different parts. Returns the rays traced.
  std::uint64_t run(const PixelRect& part, const GazeDensity& density) const;

 private:
  std::uint64_t run_blocks(const PixelRect& part, int side) const;

  const SurfacePass& surfaces_;
  const SparseSurfaces* const sparse_;
  const HistoryLookup& lookup_;
  PreviewHistory& history_;
};

}  // namespace helio
