#include "renderer/frame/stages/history_transfer.h"

#include <algorithm>

#include "renderer/base/check.h"
#include "renderer/base/hash.h"
#include "renderer/film/allocation/first_samples.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/tile_grid.h"

namespace helio {
namespace {

// A source that knows this share of its picture's samples of a pixel need not be bettered by another.
constexpr double kEnough = 0.5;
// The paths that measure what an edit has changed are none of those of the picture.
constexpr std::uint64_t kOtherPaths = 0x6a09e667f3bcc909;
// Of a region's pixels, the share that must be known for counts to fill up what is missing.
constexpr double kFillShare = 0.25;

}  // namespace

std::vector<std::shared_ptr<const RenderScene>> PictureHistory::forget() {
  std::vector<std::shared_ptr<const RenderScene>> scenes;
  for (Slot* slot : {&slots_[0], &slots_[1], &film_}) {
    if (slot->scene) scenes.push_back(std::move(slot->scene));
    slot->valid = false;
  }
  generation = 0;
  return scenes;
}

int PictureHistory::take_slot(double samples) {
  const Slot& anchor = slots_[anchor_];
  const int i = 1 - anchor_;
  promoted_ = !anchor.valid || samples >= kAnchorShare * anchor.samples;
  slots_[i] = {false, film_.scene, film_.pose, samples, film_.swapped};
  return i;
}

void PictureHistory::slot_complete(int slot) {
  slots_[slot].valid = true;
  if (promoted_) anchor_ = slot;
}

HistoryTransfer::HistoryTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                                 PictureHistory& history, const CameraPose& pose, const PixelFilter& filter,
                                 double film_samples, const PathSettings& settings)
    : scene_(std::move(scene)),
      film_(film),
      region_(region),
      history_(history),
      pose_(pose),
      filter_(filter),
      settings_(settings) {
  settings_.seed = hash64(settings.seed ^ kOtherPaths);
  windows_ = transfer_windows(region);
  if (history.film_usable() && can_reproject(history.film_pose(), filter)) {
    slot_ = history.take_slot(film_samples);
    sweeps_.push_back(Sweep::gather);
  } else {
    prepare_revision();
  }
}

void HistoryTransfer::prepare_revision() {
  std::vector<OutdatedPicture> pictures;
  for (int i = 0; i < FilmHistory::kSources; ++i) {
    const PictureHistory::Slot& slot = history_.slot(i);
    if (!slot.valid || slot.scene == scene_) continue;
    pictures.push_back({slot.scene, slot.pose, &film_.history()->source(i)});
    revised_slots_.push_back(i);
  }
  if (pictures.empty()) return prepare_reprojection();
  revision_ = std::make_unique<HistoryInvalidation>(scene_, region_, filter_, settings_, std::move(pictures));
  sweeps_.push_back(Sweep::compare);
}

// The film's own picture is with the sources by now, or of no use.
void HistoryTransfer::prepare_reprojection() {
  if (film_.splats()) film_.splats()->clear();
  std::vector<PictureSource> sources;
  for (int k = 0; k < FilmHistory::kSources && can_reproject(pose_, filter_); ++k) {
    const int i = k == 0 ? history_.anchor() : 1 - history_.anchor();
    const PictureHistory::Slot& slot = history_.slot(i);
    if (!slot.valid) continue;
    const auto enough = float(kEnough * slot.samples);
    sources.push_back(
        {slot.pose, &film_.history()->source(i), enough, slot.swapped != history_.film_swapped(), slot.edited});
  }
  if (!sources.empty()) sweeps_.push_back(Sweep::glance);
  reprojection_ = std::make_unique<Reprojection>(scene_, film_, region_, pose_, filter_, std::move(sources));
}

// Where nobody waits: these may be the last that hold a scene.
void HistoryTransfer::free_scenes() {
  revision_.reset();
}

std::size_t HistoryTransfer::parts() const {
  if (current_ >= sweeps()) return 0;
  switch (sweeps_[std::size_t(current_)]) {
    case Sweep::compare:
      return 1;
    case Sweep::measure:
      return revision_->measure_parts();
    case Sweep::collect:
      return revision_->collect_parts();
    case Sweep::carry:
      return order_->parts();
    default:
      return windows_.size();
  }
}

WindowOrder* HistoryTransfer::order() {
  return sweeps_[std::size_t(current_)] == Sweep::carry ? &*order_ : nullptr;
}

void HistoryTransfer::resume(const TileGrid& grid, bool first_samples) {
  HELIO_DCHECK(reprojection_ && current_ == sweeps());
  history_.film_overwritten();  // who is stopped from here on begins anew
  current_ = 0;
  if (!can_reproject(pose_, filter_)) {
    sweeps_ = {Sweep::clear};
    return;
  }
  sweeps_ = {Sweep::carry};
  first_samples_ = first_samples;
  std::vector<PixelRect> tiles;
  for (const Tile& tile : grid.tiles()) tiles.push_back(tile.window);
  order_.emplace(tiles);
}

void HistoryTransfer::run(int sweep, std::size_t part, TraceStats&) {
  ReprojectionStats stats;
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::gather:
      film_.history()->source(slot_).gather(film_, windows_[part], region_);
      return;
    case Sweep::compare:
      revision_->compare();
      return;
    case Sweep::measure:
      revision_->measure(part, stats);
      break;
    case Sweep::collect:
      revision_->collect(part);
      return;
    case Sweep::revise:
      revision_->revise(windows_[part], stats);
      break;
    case Sweep::glance: {
      const Reprojection::Glance glance = reprojection_->glance(windows_[part], stats);
      asked_ += glance.asked;
      known_ += glance.known;
      break;
    }
    case Sweep::clear:
      if (part == 0) free_scenes();
      reprojection_->clear(windows_[part]);
      return;
    case Sweep::carry:
      if (part == 0) free_scenes();
      carry(part, stats);
      break;
  }
  add_stats(stats);
}

void HistoryTransfer::carry(std::size_t part, ReprojectionStats& stats) {
  const auto [sweep, window] = order_->part(part);
  switch (sweep) {
    case 0:
      return reprojection_->carry(window, stats);
    case 1:
      return reprojection_->find_borders(window, stats);
    default:
      reprojection_->settle(window, stats);
      if (first_samples_) targets_ += target_first_samples(film_, window);
  }
}

void HistoryTransfer::finish_sweep(int sweep) {
  current_ = sweep + 1;
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::gather:
      history_.slot_complete(slot_);
      history_.film_overwritten();
      prepare_revision();
      return;
    case Sweep::compare:
      if (revision_->measure_parts() > 0) sweeps_.insert(sweeps_.end(), {Sweep::measure, Sweep::collect});
      // Bounds that are added twice are bounds; pictures scaled twice would be wrong.
      for (std::size_t k = 0; k < revised_slots_.size(); ++k) {
        if (revision_->scales(k)) history_.slot_in_revision(revised_slots_[k]);
      }
      sweeps_.push_back(Sweep::revise);
      return;
    case Sweep::collect:
      revision_->finish_collecting();
      return;
    case Sweep::revise:
      for (std::size_t k = 0; k < revised_slots_.size(); ++k)
        history_.slot_revised(revised_slots_[k], scene_, revision_->edits_what_shows(k));
      prepare_reprojection();
      return;
    case Sweep::glance:
    case Sweep::measure:
      return;
    case Sweep::clear:
    case Sweep::carry:
      if (first_samples_) film_.targets()->round = round_of_first_samples(targets_);
      reprojection_.reset();
      history_.film_complete(scene_, pose_);
      note_complete();
      return;
  }
}

void HistoryTransfer::note(PictureState& picture) {
  FrameState& state = picture.state;
  if (!complete()) {
    state.transfer_prepared = true;
    state.fill = known_ > 0 && double(known_) >= kFillShare * double(asked_);
    return;
  }
  state.reproject_due = false;
  state.carried = stats().carried > 0;
  if (!first_samples_) return;
  RoundState& round = state.round;
  round.number = round.first_samples = 1;
  round.mean = 0;
  round.summary = film_.targets()->round;
}

}  // namespace helio
