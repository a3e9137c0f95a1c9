#include "renderer/frame/stages/integrate.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {

namespace {

// Assumed before anything was measured: a slow path, so that the first piece is a short one.
constexpr double kFirstCostGuess = 4e-6;
// Handing out a piece costs a few microseconds, so it is not cut smaller than this for the sake of an even end.
constexpr std::uint64_t kSmallestShare = 512;

}  // namespace

// The next samples of the cell; false: it has all that it should have.
bool IntegratePass::wants(const Cell& cell, SampleRange& range) const {
  for (int h = 0; h < kHalves; ++h) {
    const std::uint32_t end = std::min(target_[h], cell.top[h]);
    if (cell.done[h] >= end) continue;
    range = {h, cell.done[h], end - cell.done[h]};
    return true;
  }
  range = {0, 0, 0};
  return clear_rest_ && !cell.rendered;
}

std::uint64_t IntegratePass::count_samples(const SampleRange& range, const PixelRect& window) const {
  if (targets_) return targets_->samples_in(*film_, range.half, window, range.first, range.count);
  return std::uint64_t(window.area()) * range.count;
}

// Of the range, so many levels that a cell takes about `samples` samples in them; at least one.
std::uint32_t IntegratePass::affordable_levels(const SampleRange& range, const PixelRect& cell,
                                               std::uint64_t samples) const {
  constexpr std::uint64_t kCellArea = kCellSize * kCellSize;
  const auto most = [&](std::uint64_t levels) {
    return std::uint32_t(std::clamp<std::uint64_t>(levels, range.count > 0, range.count));
  };
  if (!targets_) return most(samples / kCellArea);
  std::uint32_t levels = most(1);
  while (levels < range.count) {
    const std::uint32_t next = std::min<std::uint64_t>(range.count, 2 * std::uint64_t(levels));
    if (count_samples({range.half, range.first, next}, cell) > samples) break;
    levels = next;
  }
  return levels;
}

// Whether two cells both get light paths, or neither does.
bool IntegratePass::alike(const PixelRect& a, const PixelRect& b) const {
  const LightTiles* tiles = film_->light_tiles().get();
  return !tiles || tiles->on(a.x0, a.y0) == tiles->on(b.x0, b.y0);
}

double IntegratePass::sample_cost(std::size_t tile) const {
  if (tile_cost_[tile] > 0) return tile_cost_[tile];
  return mean_cost_ > 0 ? mean_cost_ : kFirstCostGuess;
}

void IntegratePass::begin(const FramePlan& plan, TileGrid& grid, const Film& film, Tiles state,
                          const LightVertexCache* lights) {
  HELIO_DCHECK(in_flight_ == 0);
  lights_ = lights;
  film_ = &film;
  targets_ = plan.round ? film.targets() : nullptr;
  std::copy(plan.target, plan.target + kHalves, target_);
  clear_rest_ = plan.final;
  stopped_ = false;
  first_tile_ = 0;
  open_cells_ = 0;
  samples_left_ = 0;
  const std::vector<Tile>& tiles = grid.tiles();
  cells_left_.assign(tiles.size(), 0);
  tile_cost_.resize(tiles.size(), 0.0f);
  for (std::uint32_t t = 0; state == Tiles::open && t < tiles.size(); ++t) count_cells(t, grid);
}

void IntegratePass::open(std::uint32_t tile, TileGrid& grid) {
  if (targets_) grid.begin_round(*targets_, grid.tiles()[tile]);
  grid.mark_prepared(grid.tiles()[tile]);
  count_cells(tile, grid);
  first_tile_ = std::min<std::size_t>(first_tile_, tile);
}

// What a tile is to get.
void IntegratePass::count_cells(std::uint32_t t, const TileGrid& grid) {
  const Tile& tile = grid.tiles()[t];
  for (int row = 0; row < tile.rows; ++row) {
    for (int column = 0; column < tile.columns; ++column) {
      const Cell& cell = grid.cell(tile, column, row);
      SampleRange range;
      if (!wants(cell, range)) continue;
      ++cells_left_[t];
      const auto area = std::uint64_t(grid.window(tile, column, row, 1).area());
      for (int h = 0; h < kHalves; ++h) {
        const std::uint32_t end = std::min(target_[h], cell.top[h]);
        samples_left_ += area * (std::max(end, cell.done[h]) - cell.done[h]);
      }
    }
  }
  if (!stopped_) open_cells_ += cells_left_[t];
}

std::optional<IntegratePiece> IntegratePass::next(TileGrid& grid, double seconds) {
  if (open_cells_ == 0) return std::nullopt;
  const std::vector<Tile>& tiles = grid.tiles();
  while (cells_left_[first_tile_] == 0) ++first_tile_;
  for (std::size_t t = first_tile_; t < tiles.size(); ++t) {
    if (cells_left_[t] == 0) continue;
    const Tile& tile = tiles[t];
    for (int row = 0; row < tile.rows; ++row) {
      for (int column = 0; column < tile.columns; ++column) {
        const Cell& first = grid.cell(tile, column, row);
        SampleRange range;
        if (first.busy || !wants(first, range)) continue;

        const std::uint64_t fair_share = std::max(samples_left_ / (4 * std::uint64_t(threads_)), kSmallestShare);
        const auto affordable = std::uint64_t(std::clamp(seconds / sample_cost(t), 1.0, 1e9));
        const std::uint64_t samples = std::min(fair_share, affordable);
        range.count = affordable_levels(range, grid.window(tile, column, row, 1), samples);
        std::uint64_t taken = 0;

        IntegratePiece piece;
        piece.tile = std::uint32_t(t);
        piece.column = column;
        piece.row = row;
        piece.clear = !first.rendered;
        for (int c = column; c < tile.columns; ++c) {
          Cell& cell = grid.cell(tile, c, row);
          SampleRange other;
          if (cell.busy || cell.rendered != first.rendered || !wants(cell, other)) break;
          if (other.half != range.half || other.first != range.first) break;
          // Without targets a piece is a rectangle of samples; with them, pixels stop where their target is.
          if (!targets_ && other.count < range.count) break;
          // The kernels that trace pieces are for tiles of one kind.
          if (!alike(grid.window(tile, column, row, 1), grid.window(tile, c, row, 1))) break;
          const std::uint64_t more = count_samples(range, grid.window(tile, c, row, 1));
          if (c > column && taken + more > samples) break;
          taken += more;
          ++piece.cells;
        }
        for (int c = column; c < column + piece.cells; ++c) grid.cell(tile, c, row).busy = true;
        piece.range = range;
        piece.samples = taken;
        piece.window = grid.window(tile, column, row, piece.cells);
        piece.targets = targets_;
        piece.lights = lights_;
        open_cells_ -= std::uint64_t(piece.cells);
        ++in_flight_;
        return piece;
      }
    }
  }
  HELIO_DCHECK(false && "open_cells_ counts a cell that no tile has");
  open_cells_ = 0;
  return std::nullopt;
}

void IntegratePass::finish(const IntegratePiece& piece, bool done, double seconds, TileGrid& grid) {
  --in_flight_;
  const Tile& tile = grid.tiles()[piece.tile];
  for (int c = piece.column; c < piece.column + piece.cells; ++c) {
    Cell& cell = grid.cell(tile, c, piece.row);
    cell.busy = false;
    if (done) {
      const int h = piece.range.half;
      cell.done[h] = std::min(cell.done[h] + piece.range.count, cell.top[h]);
      cell.rendered = true;
    }
    SampleRange range;
    if (!wants(cell, range)) {
      --cells_left_[piece.tile];
    } else if (!stopped_) {
      ++open_cells_;
    }
  }
  if (!done || piece.samples == 0) return;
  samples_left_ -= std::min(samples_left_, piece.samples);
  const double cost = seconds / double(piece.samples);
  mean_cost_ = mean_cost_ > 0 ? mean_cost_ + 0.1 * (cost - mean_cost_) : cost;
  float& tile_cost = tile_cost_[piece.tile];
  tile_cost = tile_cost > 0 ? float(tile_cost + 0.3 * (cost - tile_cost)) : float(cost);
}

bool run_integrate(const IntegratePiece& piece, const IntegrateFunction& integrate, const CameraPose& camera,
                   const RenderSettings& settings, const CancelToken& cancel, Film& film, TraceStats& stats) {
  if (cancel.cancelled()) return false;
  if (piece.clear) film.clear(piece.window);
  if (piece.range.count == 0) return true;
  return integrate({camera, settings, piece.range, piece.window, piece.targets, piece.lights}, cancel, film, stats);
}

}  // namespace helio
