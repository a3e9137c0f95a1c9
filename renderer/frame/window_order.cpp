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
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    for (const PixelRect& window : cut_aligned(tiles[t], kWindow, kWindow)) {
      windows_.push_back(window);
      tile_of_.push_back(t);
      ++left_[t];
    }
    if (left_[t] == 0) finished_tiles_.push(t);
  }
  if (windows_.empty()) return;
  find_neighbours();

  const std::size_t count = windows_.size();
  waits_.resize(kSweeps * count);
  rank_.assign(kSweeps * count, kNone);
  for (std::size_t w = 0; w < count; ++w) {
    for (int sweep = 1; sweep < kSweeps; ++sweep)
      waits_[std::size_t(sweep) * count + w] = std::uint8_t(neighbours_[w].size());
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
      for (const std::uint32_t near : neighbours_[w]) {
        for (const std::uint32_t far : neighbours_[near]) rank(0, far);
      }
    }
    for (std::uint32_t w = first; w < end; ++w) {
      for (const std::uint32_t near : neighbours_[w]) rank(1, near);
    }
    for (std::uint32_t w = first; w < end; ++w) rank(2, w);
    first = end;
  }
  for (std::size_t w = 0; w < count; ++w) ready_.push(rank_[w]);
}

void WindowOrder::find_neighbours() {
  PixelRect blocks = blocks_of(windows_.front());
  for (const PixelRect& window : windows_) {
    const PixelRect own = blocks_of(window);
    blocks = {std::min(blocks.x0, own.x0), std::min(blocks.y0, own.y0), std::max(blocks.x1, own.x1),
              std::max(blocks.y1, own.y1)};
  }
  std::vector<std::uint32_t> window_of(std::size_t(blocks.area()), kNone);
  const auto at = [&](int x, int y) -> std::uint32_t& {
    return window_of[std::size_t(y - blocks.y0) * std::size_t(blocks.width()) + std::size_t(x - blocks.x0)];
  };
  for (std::uint32_t w = 0; w < windows_.size(); ++w) {
    const PixelRect own = blocks_of(windows_[w]);
    for (int y = own.y0; y < own.y1; ++y) {
      for (int x = own.x0; x < own.x1; ++x) at(x, y) = w;
    }
  }
  neighbours_.resize(windows_.size());
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    std::vector<std::uint32_t>& found = neighbours_[w];
    const PixelRect own = blocks_of(windows_[w]);
    const PixelRect around = intersect({own.x0 - 1, own.y0 - 1, own.x1 + 1, own.y1 + 1}, blocks);
    for (int y = around.y0; y < around.y1; ++y) {
      for (int x = around.x0; x < around.x1; ++x) {
        const std::uint32_t near = at(x, y);
        if (near != kNone && std::find(found.begin(), found.end(), near) == found.end()) found.push_back(near);
      }
    }
  }
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
  for (const std::uint32_t near : neighbours_[window]) {
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
