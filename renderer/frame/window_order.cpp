#include "renderer/frame/window_order.h"

#include <algorithm>

#include "renderer/base/check.h"
#include "renderer/film/core/film.h"
#include "renderer/film/core/film_windows.h"

namespace helio {
namespace {

constexpr std::uint32_t kNone = ~0u;

static_assert(WindowOrder::kReach == kFilmBlock && WindowOrder::kWindow % kFilmBlock == 0);

// The blocks of the film that a rectangle touches.
PixelRect blocks_of(const PixelRect& pixels) {
  return {pixels.x0 / kFilmBlock, pixels.y0 / kFilmBlock, (pixels.x1 - 1) / kFilmBlock + 1,
          (pixels.y1 - 1) / kFilmBlock + 1};
}

}  // namespace

WindowOrder::WindowOrder(const std::vector<PixelRect>& tiles) {
  left_.resize(tiles.size());
  PixelRect whole;
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    const PixelRect& tile = tiles[t];
    for (const PixelRect& window : cut_aligned(tile, kWindow, kWindow)) {
      windows_.push_back(window);
      tile_of_.push_back(t);
      ++left_[t];
    }
    whole = t == 0 ? tile
                   : PixelRect{std::min(whole.x0, tile.x0), std::min(whole.y0, tile.y0), std::max(whole.x1, tile.x1),
                               std::max(whole.y1, tile.y1)};
    if (left_[t] == 0) finished_tiles_.push(t);
  }
  if (windows_.empty()) return;
  blocks_ = blocks_of(whole);
  window_of_.assign(std::size_t(blocks_.area()), kNone);
  for (std::uint32_t w = 0; w < windows_.size(); ++w) {
    const PixelRect blocks = blocks_of(windows_[w]);
    for (int y = blocks.y0; y < blocks.y1; ++y) {
      for (int x = blocks.x0; x < blocks.x1; ++x)
        window_of_[std::size_t(y - blocks_.y0) * std::size_t(blocks_.width()) + std::size_t(x - blocks_.x0)] = w;
    }
  }

  const std::size_t count = windows_.size();
  waits_.resize(kSweeps * count);
  rank_.assign(kSweeps * count, kNone);
  std::vector<std::vector<std::uint32_t>> neighbours(count);
  for (std::size_t w = 0; w < count; ++w) {
    neighbours[w] = around(w);
    for (int sweep = 1; sweep < kSweeps; ++sweep)
      waits_[std::size_t(sweep) * count + w] = std::uint8_t(neighbours[w].size());
  }
  const auto rank = [&](int sweep, std::uint32_t window) {
    std::uint32_t& own = rank_[std::size_t(sweep) * count + window];
    if (own != kNone) return;
    own = std::uint32_t(ranked_.size());
    ranked_.push_back(std::uint32_t(std::size_t(sweep) * count + window));
  };
  for (std::uint32_t first = 0; first < count;) {
    std::uint32_t end = first;
    while (end < count && tile_of_[end] == tile_of_[first]) ++end;
    for (std::uint32_t w = first; w < end; ++w) {
      for (const std::uint32_t near : neighbours[w]) {
        for (const std::uint32_t far : neighbours[near]) rank(0, far);
      }
    }
    for (std::uint32_t w = first; w < end; ++w) {
      for (const std::uint32_t near : neighbours[w]) rank(1, near);
    }
    for (std::uint32_t w = first; w < end; ++w) rank(2, w);
    first = end;
  }
  for (std::size_t w = 0; w < count; ++w) ready_.push(rank_[w]);
}

std::vector<std::uint32_t> WindowOrder::around(std::size_t window) const {
  const PixelRect& w = windows_[window];
  const PixelRect blocks = intersect(
      blocks_of({std::max(w.x0 - kReach, 0), std::max(w.y0 - kReach, 0), w.x1 + kReach, w.y1 + kReach}), blocks_);
  std::vector<std::uint32_t> found;
  for (int y = blocks.y0; y < blocks.y1; ++y) {
    for (int x = blocks.x0; x < blocks.x1; ++x) {
      const std::uint32_t near =
          window_of_[std::size_t(y - blocks_.y0) * std::size_t(blocks_.width()) + std::size_t(x - blocks_.x0)];
      if (near != kNone && std::find(found.begin(), found.end(), near) == found.end()) found.push_back(near);
    }
  }
  return found;
}

std::optional<std::size_t> WindowOrder::next() {
  if (ready_.empty()) return std::nullopt;
  const std::uint32_t rank = ready_.top();
  ready_.pop();
  return ranked_[rank];
}

void WindowOrder::finish(std::size_t part) {
  HELIO_DCHECK(part < parts());
  const std::size_t count = windows_.size(), window = part % count, sweep = part / count;
  if (sweep + 1 == kSweeps) {
    const std::uint32_t tile = tile_of_[window];
    if (--left_[tile] == 0) finished_tiles_.push(tile);
    return;
  }
  for (const std::uint32_t near : around(window)) {
    const std::size_t after = (sweep + 1) * count + near;
    if (--waits_[after] == 0) ready_.push(rank_[after]);
  }
}

std::optional<std::uint32_t> WindowOrder::next_finished_tile() {
  if (finished_tiles_.empty()) return std::nullopt;
  const std::uint32_t tile = finished_tiles_.front();
  finished_tiles_.pop();
  return tile;
}

}  // namespace helio
