// A stage of a frame: something that is done to the film before or after samples are added. The scheduler asks for it
// by a value (StageRequest), make_stage() builds it, and the pipeline runs any list of them in the order of the plan.
// Only `trace_lights` is begun by the pipeline itself, between integration steps (LightVertexSource).
//
// To add one: a pair of files in stages/ (and in CMakeLists.txt), its id and kStages here, its name in stage.cpp, a
// case in stages/make_stage.cpp, the request in frame_scheduler.cpp with the FrameState flag that triggers it, and its
// row in pass_times() (render_loop.cpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "renderer/film/allocation/sample_allocation.h"

namespace helio {

class TileGrid;
class WindowOrder;
struct PictureState;
struct TraceStats;

// Integrating and resolving are no FrameStages: they are cut by tiles and samples, not by sweeps. Their time is counted
// with the others' all the same.
enum class StageId : std::uint8_t {
  integrate,
  resolve,
  measure,       // stages/estimate_error.h
  reproject,     // stages/history_transfer.h
  choose,        // stages/choose_integrators.h
  trace_lights,  // stages/trace_lights.h
  review,        // stages/reject_history.h
  allocate,      // stages/allocate.h
  display,       // stages/make_display.h
  preview,       // stages/preview.h
  checkpoint,    // stages/checkpoint.h
  restore,       // stages/restore.h
};
inline constexpr std::size_t kStages = 12;
// The name under which PassTime reports the stage.
const char* to_string(StageId id);
// One value a stage, as seconds are.
template <class T>
using PerStage = std::array<T, kStages>;

struct StageRequest {
  StageRequest(StageId stage) : id(stage) {}  // NOLINT: a stage of which nothing else is said

  StageId id;
  // No part of it begins later (now_s() clock). The rest of it is dropped, and the plan goes on.
  double until_s = std::numeric_limits<double>::infinity();
  AllocationRequest allocation;  // of `allocate` alone
  bool first_samples = false;    // of `reproject` alone: TemporalReprojection::resume()

  bool operator==(const StageRequest&) const = default;
};

// Goes over the film in sweeps: all parts of one, in any order (or that of order()) and on any worker, before the next
// begins. The pipeline
// looks for a cancel between parts; one that takes longer than some 5 ms holds up whoever waits for the machine.
//
// A stage that was stopped is never resumed; parts in flight still finish. All calls but run() and finish_sweep() come
// with the render loop's lock, and none while a part is in flight.
class FrameStage {
 public:
  explicit FrameStage(StageId id) : id_(id) {}
  virtual ~FrameStage() = default;
  FrameStage(const FrameStage&) = delete;
  FrameStage& operator=(const FrameStage&) = delete;

  StageId id() const { return id_; }

  // Both are asked for between sweeps: finish_sweep() may have changed them.
  virtual int sweeps() const = 0;
  virtual std::size_t parts() const = 0;  // of the sweep that comes next
  // Thread safe for parts of one sweep that are handed out together. Adds to `stats` what was traced.
  virtual void run(int sweep, std::size_t part, TraceStats& stats) = 0;
  // After every part of the sweep, on one worker.
  virtual void finish_sweep(int sweep) = 0;
  // Of the sweep that comes next, where its parts wait for each other: they are handed out as it says, and it is told
  // when they are done. Null: in any order.
  virtual WindowOrder* order() { return nullptr; }
  // After the last sweep. `grid`: what the stage has changed about the progress of cells.
  virtual void finished(TileGrid& grid) { (void)grid; }
  // At the end of the plan, when its turn is over: what it has found out about the picture.
  virtual void note(PictureState& picture) { (void)picture; }

 private:
  const StageId id_;
};

}  // namespace helio
