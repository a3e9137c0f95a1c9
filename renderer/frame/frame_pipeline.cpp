#include "renderer/frame/frame_pipeline.h"

#include <algorithm>
#include <utility>

#include "renderer/base/check.h"
#include "renderer/frame/window_order.h"

namespace helio {
namespace {

[[maybe_unused]] bool suit(const std::vector<StageRequest>& requests,
                           const std::vector<std::shared_ptr<FrameStage>>& stages) {
  return std::equal(requests.begin(), requests.end(), stages.begin(), stages.end(),
                    [](const StageRequest& request, const auto& stage) { return request.id == stage->id(); });
}

}  // namespace

StageId stage_of(const Piece& piece) {
  if (const auto* item = std::get_if<StageItem>(&piece)) return item->stage->id();
  return std::holds_alternative<IntegratePiece>(piece) ? StageId::integrate : StageId::resolve;
}

void FramePipeline::enter(Phase phase) {
  phase_ = phase;
  began_s_ = 0;
}

void FramePipeline::note_seconds(StageId id, double now_s) {
  seconds_[std::size_t(id)] = began_s_ > 0 ? now_s - began_s_ : 0;
}

void FramePipeline::start(const FramePlan& plan, const Film& film, FrameStages stages,
                          std::shared_ptr<LightVertexSource> lights) {
  HELIO_DCHECK(in_flight_ == 0 && suit(plan.before, stages.before) && suit(plan.after, stages.after));
  plan_ = plan;
  film_ = &film;
  stages_ = std::move(stages);
  lights_ = std::move(lights);
  cut_ = by_tile_ = false;
  seconds_ = {};
  finished_.clear();
  next_stage_ = 0;
  enter(Phase::before);
  begin_stage();
}

// The next stage of the list, or what comes after them all.
void FramePipeline::begin_stage() {
  began_s_ = 0;
  const auto& stages = stages_of_phase();
  if (next_stage_ < stages.size()) return runner_.begin(stages[next_stage_++]);
  if (phase_ == Phase::before) return begin_integration();
  begin_publication();
}

void FramePipeline::end_stage(double now_s) {
  const auto& stage = stages_of_phase()[next_stage_ - 1];
  if (runner_.complete()) {
    note_seconds(stage->id(), now_s);
    stage->finished(grid_);
  }
  finished_.push_back(stage);
}

// The stage in hand is done with them.
void FramePipeline::open_finished_tiles() {
  WindowOrder* order = plan_.by_tile && phase_ == Phase::before ? runner_.order() : nullptr;
  if (!order) return;
  while (const auto tile = order->next_finished_tile()) {
    if (!by_tile_) begin_samples(true);
    by_tile_ = true;
    integrate_.open(*tile, grid_);
    if (plan_.publish == Publish::early && integrate_.tile_finished(*tile)) resolve_.tile_ready(*tile);
  }
}

// closed: no tile gets any before it is opened.
void FramePipeline::begin_samples(bool closed) {
  step_ = plan_;
  integrate_.begin(plan_, grid_, *film_, closed ? IntegratePass::Tiles::closed : IntegratePass::Tiles::open);
  if (plan_.publish == Publish::early) resolve_.begin(plan_, grid_);
}

void FramePipeline::begin_integration() {
  if (lights_ && begin_step()) return;
  if (!by_tile_) {
    begin_samples(false);
    for (std::uint32_t t = 0; plan_.publish == Publish::early && t < grid_.tiles().size(); ++t) {
      if (integrate_.tile_finished(t)) resolve_.tile_ready(t);
    }
  }
  enter(Phase::integrate);
}

// The next sample of the half that has fewer, if the plan asks for any.
bool FramePipeline::begin_step() {
  std::uint32_t done[kHalves];
  grid_.done_everywhere(done);
  const bool wanted[kHalves] = {done[0] < plan_.target[0], done[1] < plan_.target[1]};
  if (!wanted[0] && !wanted[1]) return false;
  const int h = wanted[0] && (!wanted[1] || done[0] <= done[1]) ? 0 : 1;
  step_ = plan_;
  step_.target[h] = done[h] + 1;
  step_.target[1 - h] = 0;
  runner_.begin(lights_->begin(h, done[h]));
  phase_ = Phase::lights;  // began_s_ stays: of all steps together
  return true;
}

void FramePipeline::integrate_step() {
  integrate_.begin(step_, grid_, *film_, IntegratePass::Tiles::open, lights_->cache());
  phase_ = Phase::integrate;
}

void FramePipeline::end_integration(double now_s) {
  cut_ = integrate_.stopped();
  if (cut_) return enter(Phase::over);
  if (lights_ && begin_step()) return;
  note_seconds(StageId::integrate, now_s);
  next_stage_ = 0;
  enter(Phase::after);
  begin_stage();
}

void FramePipeline::begin_publication() {
  if (plan_.publish == Publish::round) resolve_.begin(plan_, grid_);
  enter(Phase::publish);
}

// Leaves whatever is finished.
void FramePipeline::go_on(double now_s) {
  for (;;) {
    switch (phase_) {
      case Phase::before:
      case Phase::after:
        if (!runner_.finished()) return;
        end_stage(now_s);
        begin_stage();
        break;
      case Phase::lights:
        if (!runner_.finished() || in_flight_ > 0) return;  // those that were stopped still add to the film
        if (lights_->cache()) {
          integrate_step();
        } else {
          cut_ = true;
          enter(Phase::over);
        }
        break;
      case Phase::integrate:
        if (!integrate_.finished() || !resolve_.finished()) return;
        end_integration(now_s);
        break;
      case Phase::publish:
        if (!resolve_.finished()) return;
        if (plan_.publish == Publish::round) note_seconds(StageId::resolve, now_s);
        enter(Phase::over);
        return;
      case Phase::over:
        return;
    }
  }
}

std::optional<Piece> FramePipeline::take(bool room, double now_s) {
  const bool adds_samples = phase_ == Phase::integrate || by_tile_;
  if (adds_samples && integrate_.any_open() && now_s >= plan_.deadline_s) integrate_.stop();
  if (phase_ == Phase::lights && runner_.parts_open() && now_s >= plan_.deadline_s) runner_.stop();
  if (runs_stages() && runner_.parts_open() && now_s >= requests_of_phase()[next_stage_ - 1].until_s) runner_.stop();
  go_on(now_s);

  std::optional<Piece> piece;
  if (room && resolve_.any_open()) {
    piece = resolve_.next(grid_);
  } else if (phase_ == Phase::integrate || (adds_samples && integrate_.any_open())) {
    const double seconds = std::min(piece_seconds_, plan_.deadline_s - now_s);
    if (auto next = integrate_.next(grid_, seconds)) piece = *next;
  } else if (runs_stages() || phase_ == Phase::lights) {
    if (auto next = runner_.next()) piece = std::move(*next);
  }
  if (!piece) return std::nullopt;
  if (began_s_ == 0) began_s_ = now_s;
  ++in_flight_;
  return piece;
}

bool FramePipeline::may_take(bool room) const {
  if (room && resolve_.any_open()) return true;
  if (by_tile_ && integrate_.any_open()) return true;
  if (phase_ == Phase::integrate) return integrate_.any_open();
  return (runs_stages() || phase_ == Phase::lights) && runner_.any_open();
}

void FramePipeline::finish(const Piece& piece, bool done, double seconds, double now_s) {
  --in_flight_;
  if (const auto* integrate = std::get_if<IntegratePiece>(&piece)) {
    integrate_.finish(*integrate, done, seconds, grid_);
    const bool running = phase_ == Phase::integrate || (by_tile_ && phase_ == Phase::before);
    if (running && plan_.publish == Publish::early && integrate_.tile_finished(integrate->tile))
      resolve_.tile_ready(integrate->tile);
  } else if (const auto* item = std::get_if<StageItem>(&piece)) {
    runner_.finish(*item, done);
    if (!done) return;  // the owner gives the plan up
    open_finished_tiles();
  } else {
    resolve_.finish();
  }
  go_on(now_s);
}

void FramePipeline::release_stages() noexcept {
  runner_.stop();
  stages_.before.clear();
  stages_.after.clear();
  finished_.clear();
}

void FramePipeline::stop() {
  runner_.stop();
  integrate_.stop();
  resolve_.stop();
  enter(Phase::over);
}

}  // namespace helio
