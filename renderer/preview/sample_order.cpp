#include "renderer/preview/sample_order.h"

namespace helio {
namespace {

// Rank of a pixel among 4x4: Bayer's matrix, whose first 2^k ranks are spread evenly.
constexpr std::uint8_t kBayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
constexpr int kTurns = 16;

// Cells of 4x4 take turns likewise: the first turn of the first rank meets one pixel in 256.
int turn_of(int x, int y) {
  return kBayer[y / 4 % 4][x / 4 % 4];
}

}  // namespace

SampleOrder::Wanted SampleOrder::find(const PixelRect& window, const PreviewHistory& history) {
  // Ranks move from preview to preview, so that the same gap is not always served first.
  const int shift = int(history.frame % 16 * 7);
  const std::size_t many = std::size_t(window.area()) / 4;
  Wanted wanted;
  std::size_t listed = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const PreviewPixel& pixel = history.current.pixels[history.index(x, y)];
      if (pixel.samples >= kSettledSamples) continue;
      for (std::size_t k = 0; k < wanted.below.size(); ++k) wanted.below[k] += pixel.samples < kFilterLimits[k];
      const int rank = (kBayer[y % 4][x % 4] + shift) % kClasses;
      // There is never time for so many.
      if (rank >= kClasses / 4 && listed >= many) continue;
      ++listed;
      (pixel.samples == 0 ? wanted.gaps : wanted.noisy)[std::size_t(rank)].push_back({x, y});
    }
  }
  return wanted;
}

std::vector<PixelPosition> SampleOrder::merge(const std::vector<Wanted>& windows, std::size_t most) {
  std::vector<PixelPosition> pixels;
  for (const bool gaps : {true, false}) {
    for (int rank = 0; rank < kClasses; ++rank) {
      for (int turn = 0; turn < kTurns; ++turn) {
        for (const Wanted& window : windows) {
          for (const PixelPosition& p : (gaps ? window.gaps : window.noisy)[std::size_t(rank)]) {
            if (turn_of(p.x, p.y) != turn) continue;
            if (pixels.size() >= most) return pixels;
            pixels.push_back(p);
          }
        }
      }
    }
  }
  return pixels;
}

}  // namespace helio
