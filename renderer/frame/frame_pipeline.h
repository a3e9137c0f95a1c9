// Carries out one plan after another: its stages, samples and publication, in this order, each cut into pieces that
// workers take. Where integrating draws on light vertices, tracing those and integrating take turns, one sample of one
// half at a time. A plan may let samples and publication follow a stage tile by tile (FramePlan::by_tile).
//
// Between the pieces the owner decides: it hands in the clock (a plan's deadline stops its integration and drops the
// rest) and may stop() at any time. Not thread safe: the owner's lock guards everything but the running of a piece.
#pragma once

#include <cstddef>
#include <optional>
#include <variant>
#include <vector>

#include "renderer/frame/frame_plan.h"
#include "renderer/frame/stage_runner.h"
#include "renderer/frame/stages/integrate.h"
#include "renderer/frame/stages/resolve.h"
#include "renderer/frame/stages/trace_lights.h"
#include "renderer/frame/tile_grid.h"

namespace helio {

using Piece = std::variant<IntegratePiece, StageItem, ResolvePiece>;

// The stage that a piece's processor time is charged to.
StageId stage_of(const Piece& piece);

// The stages of one plan, in the order of its requests.
struct FrameStages {
  std::vector<std::shared_ptr<FrameStage>> before, after;
};

class FramePipeline {
 public:
  FramePipeline(int threads, double piece_seconds) : integrate_(threads), piece_seconds_(piece_seconds) {}

  // All of these need in_flight() == 0.
  void set_grid(const PixelRect& region, int tile_size) { grid_ = TileGrid(region, tile_size); }
  void forget_samples() { grid_.clear(); }
  void mark_prepared() { grid_.mark_prepared(); }
  void begin_frame() { resolve_.begin_frame(grid_.tiles().size()); }
  // lights: the integrator draws on it.
  void start(const FramePlan& plan, const Film& film, FrameStages stages = {},
             std::shared_ptr<LightVertexSource> lights = nullptr);

  // The next piece of the plan. `room`: whether another resolved tile can be stored. Nothing: what is left is in
  // flight, waits for room, or the plan is over.
  std::optional<Piece> take(bool room, double now_s);
  // Whether take() would probably find a piece; never false when it would.
  bool may_take(bool room) const;
  // `done`: the piece has run to its end. seconds: processor time of the piece.
  void finish(const Piece& piece, bool done, double seconds, double now_s);

  // Drops everything that is not in flight.
  void stop();
  // Lets go of the stages of a plan that is over.
  void release_stages() noexcept;

  bool over() const { return phase_ == Phase::over; }
  // The plan's deadline came before its samples were in.
  bool cut() const { return cut_; }
  int in_flight() const { return in_flight_; }
  const FramePlan& plan() const { return plan_; }
  const TileGrid& grid() const { return grid_; }
  // Wall time that a stage of the newest plan took, first piece taken to last piece finished; 0: not run to its end.
  // integrate: light vertices included; resolve: of whole publications.
  double seconds(StageId id) const { return seconds_[std::size_t(id)]; }
  // The plan's stages that have ended, in order, those stopped early included.
  const std::vector<std::shared_ptr<FrameStage>>& finished_stages() const { return finished_; }
  bool published_final() const { return resolve_.all_final(); }

 private:
  enum class Phase { before, lights, integrate, after, publish, over };
  void enter(Phase phase);
  bool runs_stages() const { return phase_ == Phase::before || phase_ == Phase::after; }
  const std::vector<StageRequest>& requests_of_phase() const {
    return phase_ == Phase::before ? plan_.before : plan_.after;
  }
  const std::vector<std::shared_ptr<FrameStage>>& stages_of_phase() const {
    return phase_ == Phase::before ? stages_.before : stages_.after;
  }
  void begin_stage();
  void end_stage(double now_s);
  void open_finished_tiles();
  void begin_samples(bool closed);
  void begin_integration();
  bool begin_step();
  void integrate_step();
  void end_integration(double now_s);
  void begin_publication();
  void go_on(double now_s);
  void note_seconds(StageId id, double now_s);

  FramePlan plan_;
  const Film* film_ = nullptr;
  FrameStages stages_;
  std::size_t next_stage_ = 0;  // in the list of the phase
  StageRunner runner_;          // of the stage in hand, or of light vertices
  std::vector<std::shared_ptr<FrameStage>> finished_;
  std::shared_ptr<LightVertexSource> lights_;  // null: integrating is one step
  FramePlan step_;                             // what the integration in hand goes for
  TileGrid grid_;
  IntegratePass integrate_;
  ResolvePass resolve_;
  double piece_seconds_;
  Phase phase_ = Phase::over;
  bool cut_ = false;
  bool by_tile_ = false;  // tiles are opened to samples as the stage in hand is done with them, or all are open by now
  int in_flight_ = 0;
  double began_s_ = 0;  // 0: no piece was taken yet
  PerStage<double> seconds_{};
};

}  // namespace helio
