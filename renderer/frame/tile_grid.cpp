#include "renderer/frame/tile_grid.h"

#include "renderer/base/check.h"

namespace helio {

namespace {

int align_down(int x, int step) {
  return x / step * step;
}  // x >= 0
int cells_across(int from, int to) {
  return (to - align_down(from, kCellSize) + kCellSize - 1) / kCellSize;
}

}  // namespace

std::size_t blocks_of(const PixelRect& region) {
  return std::size_t(cells_across(region.x0, region.x1)) * std::size_t(cells_across(region.y0, region.y1));
}

TileGrid::TileGrid(const PixelRect& region, int tile_size) : region_(region) {
  const int size = (std::max(tile_size, 1) + kCellSize - 1) / kCellSize * kCellSize;
  for (int y = align_down(region.y0, size); y < region.y1; y += size) {
    for (int x = align_down(region.x0, size); x < region.x1; x += size) {
      Tile tile;
      tile.window = intersect({x, y, x + size, y + size}, region);
      tile.columns = cells_across(tile.window.x0, tile.window.x1);
      tile.rows = cells_across(tile.window.y0, tile.window.y1);
      tiles_.push_back(tile);
    }
  }
  const auto from_middle = [&](const Tile& tile) {
    const std::int64_t dx = std::int64_t(tile.window.x0) + tile.window.x1 - region.x0 - region.x1;
    const std::int64_t dy = std::int64_t(tile.window.y0) + tile.window.y1 - region.y0 - region.y1;
    return dx * dx + dy * dy;
  };
  std::stable_sort(tiles_.begin(), tiles_.end(),
                   [&](const Tile& a, const Tile& b) { return from_middle(a) < from_middle(b); });
  std::uint32_t cells = 0;
  for (Tile& tile : tiles_) {
    tile.first_cell = cells;
    cells += std::uint32_t(tile.columns * tile.rows);
  }
  cells_.resize(cells);
}

PixelRect TileGrid::window(const Tile& tile, int column, int row, int count) const {
  const int x = align_down(tile.window.x0, kCellSize) + column * kCellSize;
  const int y = align_down(tile.window.y0, kCellSize) + row * kCellSize;
  return intersect({x, y, x + count * kCellSize, y + kCellSize}, tile.window);
}

void TileGrid::clear() {
  for (Cell& cell : cells_) {
    const bool busy = cell.busy;
    cell = {};
    cell.busy = busy;
  }
}

void TileGrid::mark_prepared() {
  for (Cell& cell : cells_) cell.rendered = true;
}

void TileGrid::mark_prepared(const Tile& tile) {
  const auto first = cells_.begin() + std::ptrdiff_t(tile.first_cell);
  std::for_each_n(first, tile.columns * tile.rows, [](Cell& cell) { cell.rendered = true; });
}

void TileGrid::begin_round(const SampleTargets& targets) {
  for (const Tile& tile : tiles_) begin_round(targets, tile);
}

void TileGrid::begin_round(const SampleTargets& targets, const Tile& tile) {
  for (int row = 0; row < tile.rows; ++row) {
    for (int column = 0; column < tile.columns; ++column) {
      const PixelRect pixels = window(tile, column, row, 1);
      const BlockLevels& levels = targets.block(pixels.x0, pixels.y0);
      Cell& c = cell(tile, column, row);
      for (int h = 0; h < kHalves; ++h) {
        c.done[h] = levels.first[h];
        c.top[h] = levels.top[h];
      }
    }
  }
}

void TileGrid::done_everywhere(std::uint32_t done[kHalves]) const {
  for (int h = 0; h < kHalves; ++h) {
    std::uint32_t least = ~0u, most = 0;
    for (const Cell& cell : cells_) {
      if (cell.done[h] < cell.top[h]) least = std::min(least, cell.done[h]);
      most = std::max(most, cell.done[h]);
    }
    done[h] = least < ~0u ? least : most;
  }
}

// visit(index of the cell, its number in the region, row by row).
template <class Visit>
void TileGrid::for_cells(const Visit& visit) const {
  const int columns = cells_across(region_.x0, region_.x1);
  for (const Tile& tile : tiles_) {
    const int first_column = (tile.window.x0 - align_down(region_.x0, kCellSize)) / kCellSize;
    const int first_row = (tile.window.y0 - align_down(region_.y0, kCellSize)) / kCellSize;
    for (int row = 0; row < tile.rows; ++row) {
      for (int column = 0; column < tile.columns; ++column)
        visit(index(tile, column, row), std::size_t((first_row + row) * columns + first_column + column));
    }
  }
}

std::vector<CellProgress> TileGrid::progress() const {
  std::vector<CellProgress> progress(cells_.size());
  for_cells([&](std::size_t cell, std::size_t number) {
    CellProgress& stored = progress[number];
    std::copy(cells_[cell].done, cells_[cell].done + kHalves, stored.done);
    std::copy(cells_[cell].top, cells_[cell].top + kHalves, stored.top);
    stored.rendered = cells_[cell].rendered;
  });
  return progress;
}

void TileGrid::set_progress(const std::vector<CellProgress>& progress) {
  HELIO_DCHECK(progress.size() == cells_.size());
  for_cells([&](std::size_t cell, std::size_t number) {
    const CellProgress& stored = progress[number];
    std::copy(stored.done, stored.done + kHalves, cells_[cell].done);
    std::copy(stored.top, stored.top + kHalves, cells_[cell].top);
    cells_[cell].rendered = stored.rendered;
  });
}

std::uint32_t TileGrid::samples_in(const Tile& tile) const {
  std::uint32_t least = ~0u;
  for (int i = 0; i < tile.columns * tile.rows; ++i) {
    const Cell& cell = cells_[tile.first_cell + std::size_t(i)];
    least = std::min(least, cell.done[0] + cell.done[1]);
  }
  return least;
}

}  // namespace helio
