// How the rendered region is cut: into tiles, which are published, and those into cells, which hold the progress.
//
// Both are aligned to the film, not to the region, and clipped to the region.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/film/core/film.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Side of a cell in pixels: the integrator's blocks, so that no path is traced in vain. One sample of each of its
// pixels takes less than 5 ms up to 20 us a path.
inline constexpr int kCellSize = kPathGroupSize;

// Progress in levels: level s is the sample of index s of every pixel of the cell that takes part in it. Without sample
// targets that is every pixel, so levels done are samples that each has.
struct Cell {
  static constexpr std::uint32_t kNoTop = ~0u;

  std::uint32_t done[kHalves] = {0, 0};           // levels
  std::uint32_t top[kHalves] = {kNoTop, kNoTop};  // no pixel takes part in this level and those above it
  bool busy = false;      // a piece is working on it
  bool rendered = false;  // the film's pixels are of this picture; false: whatever an older one left there
};

// A cell's as it is stored. rendered: as in Cell.
struct CellProgress {
  std::uint32_t done[kHalves] = {0, 0}, top[kHalves] = {Cell::kNoTop, Cell::kNoTop};
  bool rendered = false;
};

// Cells of a region, however it is cut into tiles.
std::size_t blocks_of(const PixelRect& region);

struct Tile {
  PixelRect window;
  std::uint32_t first_cell = 0;  // cells are row-major
  int columns = 0, rows = 0;
};

class TileGrid {
 public:
  TileGrid() = default;
  // Tiles are ordered from the region's middle outwards. tile_size is rounded up to a multiple of kCellSize.
  TileGrid(const PixelRect& region, int tile_size);

  const PixelRect& region() const { return region_; }
  const std::vector<Tile>& tiles() const { return tiles_; }
  Cell& cell(const Tile& tile, int column, int row) { return cells_[index(tile, column, row)]; }
  const Cell& cell(const Tile& tile, int column, int row) const { return cells_[index(tile, column, row)]; }

  // Pixels of `count` neighbouring cells of one row.
  PixelRect window(const Tile& tile, int column, int row, int count) const;

  // Forgets all samples. Cells stay busy: pieces in flight still hold them.
  void clear();

  // The film's pixels are of this picture, whatever they hold. No piece is in flight.
  void mark_prepared();
  void mark_prepared(const Tile& tile);

  // Whether the film's pixels are of this picture, all of them.
  bool all_rendered() const {
    return std::all_of(cells_.begin(), cells_.end(), [](const Cell& cell) { return cell.rendered; });
  }

  // Takes over what a round of sample targets asks of the cells. No piece is in flight.
  void begin_round(const SampleTargets& targets);
  void begin_round(const SampleTargets& targets, const Tile& tile);

  // Levels that every cell has done, per half; cells that have none left do not count unless all are so.
  void done_everywhere(std::uint32_t done[kHalves]) const;
  // Both halves, of the tile's pixel that has the fewest; of no meaning in a round.
  std::uint32_t samples_in(const Tile& tile) const;

  // Of all cells of the region, row by row, however it is cut into tiles. No piece is in flight.
  std::vector<CellProgress> progress() const;
  // Precondition: one for each cell.
  void set_progress(const std::vector<CellProgress>& progress);

  std::size_t bytes() const { return cells_.capacity() * sizeof(Cell) + tiles_.capacity() * sizeof(Tile); }

 private:
  template <class Visit>
  void for_cells(const Visit& visit) const;
  std::size_t index(const Tile& tile, int column, int row) const {
    return tile.first_cell + std::size_t(row) * std::size_t(tile.columns) + std::size_t(column);
  }

  PixelRect region_;
  std::vector<Tile> tiles_;
  std::vector<Cell> cells_;
};

}  // namespace helio
