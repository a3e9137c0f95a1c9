#include "renderer/frame/frame_pipeline.h"

#include <algorithm>
#include <utility>

#include "renderer/base/check.h"

namespace helio {

void FramePipeline::enter(Stage stage) {
  stage_ = stage;
  stage_began_s_ = 0;
}

void FramePipeline::start(const FramePlan& plan, const Film& film, const Works& works) {
  HELIO_DCHECK(in_flight_ == 0 && bool(works.allocate) == plan.allocate.has_value() &&
         bool(works.reproject) == (plan.reproject || plan.centres) && bool(works.review) == plan.review &&
         bool(works.choose) == plan.choose);
  plan_ = plan;
  film_ = &film;
  cut_ = false;
  seconds_ = {};
  measured_.reset();
  measure_.stop();
  reproject_.begin(works.reproject);
  choice_ = works.choose;
  allocate_.begin(works.allocate);
  review_.begin(works.review);
  light_source_ = works.lights;
  if (plan.reproject || plan.centres) {
    enter(Stage::reproject);
  } else if (plan.choose) {
    begin_choice();
  } else if (plan.allocate) {
    enter(Stage::allocate);
  } else {
    begin_integration();
  }
}

// Not before: what is chosen says which splats a film has, and another picture's may still be read.
void FramePipeline::begin_choice() {
  choose_.begin(std::exchange(choice_, nullptr));
  enter(Stage::choose);
}

void FramePipeline::begin_integration() {
  const FramePlan& plan = plan_;
  if (light_source_ && begin_step()) return;
  step_ = plan;
  integrate_.begin(plan, grid_, *film_);
  if (plan.publish == Publish::early) {
    resolve_.begin(plan, grid_);
    for (std::uint32_t t = 0; t < grid_.tiles().size(); ++t) {
      if (integrate_.tile_finished(t)) resolve_.tile_ready(t);
    }
  }
  enter(Stage::integrate);
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
  lights_.begin(light_source_->begin(h, done[h]));
  const double began = stage_began_s_;
  enter(Stage::lights);
  stage_began_s_ = began;  // of all steps together
  return true;
}

void FramePipeline::integrate_step() {
  integrate_.begin(step_, grid_, *film_, light_source_->cache());
  stage_ = Stage::integrate;
}

void FramePipeline::leave_finished_stages(double now_s) {
  const auto seconds = [&] { return stage_began_s_ > 0 ? now_s - stage_began_s_ : 0.0; };
  if (stage_ == Stage::reproject && reproject_.finished()) {
    if (plan_.reproject) {
      seconds_.reproject = seconds();
      grid_.mark_prepared();
    }
    begin_choice();
  }
  if (stage_ == Stage::choose && choose_.finished()) enter(Stage::allocate);
  if (stage_ == Stage::allocate && allocate_.finished()) {
    if (plan_.allocate) grid_.begin_round(*film_->targets());
    begin_integration();
  }
  while (stage_ == Stage::lights || stage_ == Stage::integrate) {
    if (stage_ == Stage::lights) {
      if (!lights_.finished() || in_flight_ > 0) break;  // those that were stopped still add to the film
      if (light_source_->cache()) {
        integrate_step();
      } else {
        cut_ = true;
        enter(Stage::over);
      }
    } else {
      if (!integrate_.finished() || !resolve_.finished()) break;
      cut_ = integrate_.stopped();
      if (!cut_ && light_source_ && begin_step()) continue;
      if (!cut_) seconds_.integrate = seconds();
      enter(cut_ ? Stage::over : Stage::review);
    }
  }
  if (stage_ == Stage::review && review_.finished()) {
    if (plan_.measure) measure_.begin(std::make_shared<ErrorEstimate>(*film_, grid_.region()));
    enter(Stage::measure);
  }
  if (stage_ == Stage::measure && measure_.finished()) {
    if (plan_.measure) {
      seconds_.measure = seconds();
      measured_ = measure_.work()->result();
    }
    if (plan_.publish == Publish::round) resolve_.begin(plan_, grid_);
    enter(Stage::publish);
  }
  if (stage_ == Stage::publish && resolve_.finished()) {
    if (plan_.publish == Publish::round) seconds_.publish = seconds();
    enter(Stage::over);
  }
}

std::optional<Piece> FramePipeline::take(bool room, double now_s) {
  if (stage_ == Stage::integrate && integrate_.any_open() && now_s >= plan_.deadline_s) integrate_.stop();
  if (stage_ == Stage::choose && choose_.any_open() && now_s >= plan_.choose_until_s) choose_.stop();
  if (stage_ == Stage::lights && lights_.any_open() && now_s >= plan_.deadline_s) lights_.stop();
  leave_finished_stages(now_s);

  std::optional<Piece> piece;
  if (room && resolve_.any_open()) {
    piece = resolve_.next(grid_);
  } else if (stage_ == Stage::reproject) {
    if (auto next = reproject_.next()) piece = *next;
  } else if (stage_ == Stage::choose) {
    if (auto next = choose_.next()) piece = *next;
  } else if (stage_ == Stage::allocate) {
    if (auto next = allocate_.next()) piece = *next;
  } else if (stage_ == Stage::lights) {
    if (auto next = lights_.next()) piece = *next;
  } else if (stage_ == Stage::integrate) {
    const double seconds = std::min(piece_seconds_, plan_.deadline_s - now_s);
    if (auto next = integrate_.next(grid_, seconds)) piece = *next;
  } else if (stage_ == Stage::review) {
    if (auto next = review_.next()) piece = *next;
  } else if (stage_ == Stage::measure) {
    if (auto next = measure_.next()) piece = *next;
  }
  if (!piece) return std::nullopt;
  if (stage_began_s_ == 0) stage_began_s_ = now_s;
  ++in_flight_;
  return piece;
}

bool FramePipeline::may_take(bool room) const {
  if (room && resolve_.any_open()) return true;
  return (stage_ == Stage::reproject && reproject_.any_open()) || (stage_ == Stage::choose && choose_.any_open()) ||
         (stage_ == Stage::allocate && allocate_.any_open()) || (stage_ == Stage::lights && lights_.any_open()) ||
         (stage_ == Stage::review && review_.any_open()) || (stage_ == Stage::integrate && integrate_.any_open()) ||
         (stage_ == Stage::measure && measure_.any_open());
}

void FramePipeline::finish(const Piece& piece, bool done, double seconds, double now_s) {
  --in_flight_;
  if (const auto* integrate = std::get_if<IntegratePiece>(&piece)) {
    integrate_.finish(*integrate, done, seconds, grid_);
    if (stage_ == Stage::integrate && plan_.publish == Publish::early && integrate_.tile_finished(integrate->tile))
      resolve_.tile_ready(integrate->tile);
  } else if (const auto* reproject = std::get_if<ReprojectPiece>(&piece)) {
    reproject_.finish(*reproject);
  } else if (const auto* choose = std::get_if<ChoosePiece>(&piece)) {
    choose_.finish(*choose);
  } else if (const auto* allocate = std::get_if<AllocatePiece>(&piece)) {
    allocate_.finish(*allocate);
  } else if (const auto* lights = std::get_if<LightsPiece>(&piece)) {
    lights_.finish(*lights);
  } else if (const auto* review = std::get_if<RejectionPiece>(&piece)) {
    review_.finish(*review);
  } else if (const auto* measure = std::get_if<MeasurePiece>(&piece)) {
    measure_.finish(*measure);
  } else {
    resolve_.finish();
  }
  leave_finished_stages(now_s);
}

void FramePipeline::stop() {
  reproject_.stop();
  choice_.reset();
  choose_.stop();
  allocate_.stop();
  lights_.stop();
  integrate_.stop();
  review_.stop();
  measure_.stop();
  resolve_.stop();
  enter(Stage::over);
}

}  // namespace helio
