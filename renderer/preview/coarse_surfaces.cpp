#include "renderer/preview/coarse_surfaces.h"

#include <algorithm>

#include "renderer/film/core/film_windows.h"

namespace helio {

std::uint64_t CoarseSurfaces::run(const PixelRect& part, const GazeDensity& density) const {
  const float most = density.most_in(part);
  if (most <= kFullDensity) return run_blocks(part, most > kHalfDensity ? 2 : 4);
  std::uint64_t rays = 0;
  if (sparse_) {
    rays = sparse_->run(part);
  } else {
    for (const PixelRect& block : cut_aligned(part, kPathGroupSize, kPathGroupSize)) rays += surfaces_.run(block);
  }
  lookup_.run(part);
  return rays;
}

std::uint64_t CoarseSurfaces::run_blocks(const PixelRect& part, int side) const {
  constexpr std::size_t kMost = SurfacePass::kMostAtOnce;
  PixelPosition at[kMost];
  PixelRect blocks[kMost];
  PreviewPixel pixels[kMost];
  std::uint32_t colors[kMost];
  std::size_t count = 0;
  std::uint64_t rays = 0;
  const auto flush = [&] {
    surfaces_.trace({at, count}, pixels, colors);
    for (std::size_t i = 0; i < count; ++i) {
      lookup_.look_up(at[i], pixels[i]);
      for (int y = blocks[i].y0; y < blocks[i].y1; ++y) {
        const auto first = std::ptrdiff_t(history_.index(blocks[i].x0, y));
        std::fill_n(history_.current.pixels.begin() + first, blocks[i].width(), pixels[i]);
        std::fill_n(history_.colors.begin() + first, blocks[i].width(), colors[i]);
      }
    }
    rays += count;
    count = 0;
  };
  // Neighbours share packets.
  for (const PixelRect& tile : cut_aligned(part, 4 * side, 4 * side)) {
    for (const PixelRect& block : cut_aligned(tile, side, side)) {
      at[count] = {std::min(block.x0 + side / 2, block.x1 - 1), std::min(block.y0 + side / 2, block.y1 - 1)};
      blocks[count++] = block;
      if (count == kMost) flush();
    }
  }
  flush();
  return rays;
}

}  // namespace helio
