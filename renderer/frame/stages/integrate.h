// Stage: adds samples to the film until every pixel of the region has what the plan asks for.
//
// The work is handed out in pieces: a run of cells in one row of one tile, and a range of samples of one half. A cell
// is never in two pieces at once and its ranges follow one another, so each pixel is accumulated in index order. Pieces
// are sized by the measured cost of a sample to take about kPieceSeconds, and less where the work runs out, so that the
// workers finish together.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/frame/frame_plan.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/frame/tile_grid.h"

namespace helio {

// What a piece aims at: below the 5 ms that a worker may be away from the fair queue, because the next piece may meet
// costlier pixels than the last.
inline constexpr double kPieceSeconds = 3e-3;

struct IntegratePiece {
  std::uint32_t tile = 0;
  int column = 0, row = 0, cells = 0;
  PixelRect window;
  SampleRange range;                       // levels; count == 0: the pixels are only cleared
  bool clear = false;                      // the film holds an older picture there
  std::uint64_t samples = 0;               // of all its pixels
  const SampleTargets* targets = nullptr;  // who takes part in the levels; null: everyone
  const LightVertexCache* lights = nullptr;  // of this one sample; null: the integrator draws on none
};

class IntegratePass {
 public:
  // threads: how many workers may share the pass.
  explicit IntegratePass(int threads) : threads_(threads) {}

  // The bookkeeping below is not thread safe: the owner's lock guards it.

  enum class Tiles { open, closed };
  // Precondition: no piece is in flight. The film outlives the plan; with targets, the grid has begun their round.
  // Tiles that are closed get nothing until open().
  void begin(const FramePlan& plan, TileGrid& grid, const Film& film, Tiles tiles = Tiles::open,
             const LightVertexCache* lights = nullptr);
  // Of a tile that is closed: the film's pixels are of this picture, and with targets, they hold for it.
  void open(std::uint32_t tile, TileGrid& grid);
  // A piece of at most about `seconds`, or nothing when every cell that needs work is taken.
  std::optional<IntegratePiece> next(TileGrid& grid, double seconds);
  bool any_open() const { return open_cells_ > 0; }
  // `done`: the samples are in the film; else the piece was thrown away.
  void finish(const IntegratePiece& piece, bool done, double seconds, TileGrid& grid);
  // No more pieces are handed out.
  void stop() {
    open_cells_ = 0;
    stopped_ = true;
  }
  bool finished() const { return in_flight_ == 0 && (stopped_ || open_cells_ == 0); }
  bool stopped() const { return stopped_; }
  bool tile_finished(std::size_t tile) const { return cells_left_[tile] == 0; }

 private:
  void count_cells(std::uint32_t tile, const TileGrid& grid);
  bool wants(const Cell& cell, SampleRange& range) const;
  std::uint64_t count_samples(const SampleRange& range, const PixelRect& window) const;
  std::uint32_t affordable_levels(const SampleRange& range, const PixelRect& cell, std::uint64_t samples) const;
  bool alike(const PixelRect& a, const PixelRect& b) const;
  double sample_cost(std::size_t tile) const;

  int threads_;
  const Film* film_ = nullptr;
  const SampleTargets* targets_ = nullptr;  // null: every pixel takes part in every level
  const LightVertexCache* lights_ = nullptr;
  std::uint32_t target_[kHalves] = {0, 0};
  bool clear_rest_ = false;
  bool stopped_ = true;
  int in_flight_ = 0;
  std::size_t first_tile_ = 0;             // those before it are finished
  std::vector<std::uint32_t> cells_left_;  // per tile: cells below the target
  std::uint64_t open_cells_ = 0;           // below the target and in no piece
  std::uint64_t samples_left_ = 0;         // of all pixels, pieces in flight included; about, with targets
  double mean_cost_ = 0;                   // seconds per sample; 0: not measured yet
  std::vector<float> tile_cost_;           // the same, per tile
};

// Traces the piece. Thread safe for pieces of one plan. False: cancelled, the film keeps what it had.
bool run_integrate(const IntegratePiece& piece, const IntegrateFunction& integrate, const CameraPose& camera,
                   const RenderSettings& settings, const CancelToken& cancel, Film& film, TraceStats& stats);

}  // namespace helio
