// Carries out one plan after another: reproject, choose, allocate, integrate, review, measure, resolve, in this order,
// each cut into pieces that workers take. Where integrating draws on light vertices, lights and integrate take turns,
// one sample of one half at a time.
//
// Between the pieces the owner decides: it hands in the clock (a plan's deadline stops its integration and drops the
// rest) and may stop() at any time. Not thread safe: the owner's lock guards everything but the running of a piece.
#pragma once

#include <cstddef>
#include <optional>
#include <variant>

#include "renderer/frame/frame_plan.h"
#include "renderer/frame/stages/allocate.h"
#include "renderer/frame/stages/choose_integrators.h"
#include "renderer/frame/stages/integrate.h"
#include "renderer/frame/stages/estimate_error.h"
#include "renderer/frame/stages/resolve.h"
#include "renderer/frame/stages/reject_history.h"
#include "renderer/frame/stages/temporal_reprojection.h"
#include "renderer/frame/stages/trace_lights.h"
#include "renderer/frame/tile_grid.h"

namespace helio {

using Piece = std::variant<IntegratePiece, ReprojectPiece, ChoosePiece, AllocatePiece, LightsPiece, RejectionPiece,
                           MeasurePiece, ResolvePiece>;

// Wall time that the stages of the newest plan took, first piece taken to last piece finished; 0: not run to its end.
struct StageSeconds {
  double reproject = 0, integrate = 0, measure = 0, publish = 0;
};

class FramePipeline {
 public:
  FramePipeline(int threads, double piece_seconds) : integrate_(threads), piece_seconds_(piece_seconds) {}

  // All of these need in_flight() == 0.
  void set_grid(const PixelRect& region, int tile_size) { grid_ = TileGrid(region, tile_size); }
  void forget_samples() { grid_.clear(); }
  void begin_frame() { resolve_.begin_frame(grid_.tiles().size()); }
  // Those of the works that the plan asks for, on this film.
  struct Works {
    std::shared_ptr<TemporalReprojection> reproject;  // of plans that ask for centres, too
    std::shared_ptr<TechniqueChoice> choose;
    std::shared_ptr<SampleAllocation> allocate;
    std::shared_ptr<HistoryRejection> review;
    std::shared_ptr<LightVertexSource> lights;  // whenever the integrator draws on it
  };
  void start(const FramePlan& plan, const Film& film, const Works& works = {});

  // The next piece of the plan. `room`: whether another resolved tile can be stored. Nothing: what is left is in
  // flight, waits for room, or the plan is over.
  std::optional<Piece> take(bool room, double now_s);
  // What take() would probably find; never false when it would find something.
  bool may_take(bool room) const;
  // `done`: integrate: the samples are in the film. seconds: processor time of the piece.
  void finish(const Piece& piece, bool done, double seconds, double now_s);

  // Drops everything that is not in flight.
  void stop();

  bool over() const { return stage_ == Stage::over; }
  // The plan's deadline came before its samples were in.
  bool cut() const { return cut_; }
  int in_flight() const { return in_flight_; }
  const FramePlan& plan() const { return plan_; }
  const TileGrid& grid() const { return grid_; }
  const StageSeconds& seconds() const { return seconds_; }
  const std::optional<FilmError>& measured() const { return measured_; }  // by the newest plan
  bool published_final() const { return resolve_.all_final(); }

 private:
  enum class Stage { reproject, choose, allocate, lights, integrate, review, measure, publish, over };
  void enter(Stage stage);
  void begin_choice();
  void begin_integration();
  bool begin_step();
  void integrate_step();
  void leave_finished_stages(double now_s);

  FramePlan plan_;
  const Film* film_ = nullptr;
  std::shared_ptr<LightVertexSource> light_source_;  // null: integrating is one step
  FramePlan step_;                                   // what the integration in hand goes for
  TileGrid grid_;
  ReprojectPass reproject_;
  ChoosePass choose_;
  std::shared_ptr<TechniqueChoice> choice_;  // whose turn has not come
  AllocatePass allocate_;
  LightsPass lights_;
  IntegratePass integrate_;
  RejectionPass review_;
  MeasurePass measure_;
  ResolvePass resolve_;
  double piece_seconds_;
  Stage stage_ = Stage::over;
  bool cut_ = false;
  int in_flight_ = 0;
  double stage_began_s_ = 0;  // 0: no piece was taken yet
  StageSeconds seconds_;
  std::optional<FilmError> measured_;
};

}  // namespace helio
