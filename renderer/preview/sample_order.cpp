#include "renderer/preview/sample_order.h"

namespace helio {
namespace {

// Rank of a pixel among 4x4: Bayer's matrix, whose first 2^k ranks are spread evenly.
constexpr std::uint8_t kBayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
constexpr int kRanks = 16, kTurns = 16;
static_assert(SampleOrder::kClasses == kRanks * kTurns);

// Cells of 4x4 take turns likewise: the first turn of the first rank meets one pixel in 256.
int turn_of(int x, int y) {
  return kBayer[y / 4 % 4][x / 4 % 4];
}

}  // namespace

void SampleOrder::Classes::sort() {
  begin_ = {};
  for (const Pixel& pixel : pixels_) ++begin_[std::size_t(pixel.key) + 1];
  for (std::size_t k = 0; k < std::size_t(kClasses); ++k) begin_[k + 1] += begin_[k];
  sorted_.resize(pixels_.size());
  auto next = begin_;
  for (const Pixel& pixel : pixels_) sorted_[next[pixel.key]++] = pixel.at;
  pixels_ = {};
}

std::span<const PixelPosition> SampleOrder::Classes::of_class(int key) const {
  const std::uint32_t first = begin_[std::size_t(key)];
  return std::span(sorted_).subspan(first, begin_[std::size_t(key) + 1] - first);
}

SampleOrder::Wanted SampleOrder::find(const PixelRect& window, const PreviewHistory& history,
                                      const GazeDensity* density) {
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
      int key = (kBayer[y % 4][x % 4] + shift) % kRanks * kTurns + turn_of(x, y);
      if (density) {
        const float later = (float(key) + 0.5f) / density->at(float(x) + 0.5f, float(y) + 0.5f);
        if (later >= kClasses) continue;
        key = int(later);
      }
      // There is never time for so many.
      if (key >= kClasses / 4 && listed >= many) continue;
      ++listed;
      (pixel.samples == 0 ? wanted.gaps : wanted.noisy).add(key, {x, y});
    }
  }
  wanted.gaps.sort();
  wanted.noisy.sort();
  return wanted;
}

std::vector<PixelPosition> SampleOrder::merge(const std::vector<Wanted>& windows, std::size_t most) {
  std::vector<PixelPosition> pixels;
  for (const bool gaps : {true, false}) {
    for (int key = 0; key < kClasses; ++key) {
      for (const Wanted& window : windows) {
        for (const PixelPosition& p : (gaps ? window.gaps : window.noisy).of_class(key)) {
          if (pixels.size() >= most) return pixels;
          pixels.push_back(p);
        }
      }
    }
  }
  return pixels;
}

}  // namespace helio
