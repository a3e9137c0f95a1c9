#include "renderer/frame/passes/reproject.h"

#include <algorithm>

#include "renderer/film/film_history.h"

namespace helio {
namespace {

// Of a sweep's parts: about a millisecond each.
constexpr int kPartRows = kFilmBlock, kPartColumns = 16 * kFilmBlock;

}  // namespace

void PictureHistory::forget() {
  for (Slot& slot : slots_) slot.valid = false;
  film_.valid = false;
  generation = 0;
}

int PictureHistory::take_slot(double samples) {
  Slot& anchor = slots_[anchor_];
  const bool anchors = !anchor.valid || samples >= kAnchorShare * anchor.samples;
  // The new anchor holds what the old one knew, as far as it was seen.
  const int i = anchors ? anchor_ : 1 - anchor_;
  if (anchors) slots_[1 - anchor_].valid = false;
  slots_[i] = {false, film_.pose, samples, film_.swapped};
  return i;
}

void PictureHistory::slot_complete(int slot) {
  slots_[slot].valid = true;
}

HistoryTransfer::HistoryTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                                 PictureHistory& history, const CameraPose& pose, const PixelFilter& filter,
                                 double film_samples)
    : scene_(std::move(scene)), film_(film), region_(region), history_(history), pose_(pose), filter_(filter) {
  const auto next = [](int x, int step) { return (x / step + 1) * step; };
  for (int y = region.y0; y < region.y1; y = next(y, kPartRows)) {
    for (int x = region.x0; x < region.x1; x = next(x, kPartColumns))
      windows_.push_back(intersect({x, y, next(x, kPartColumns), next(y, kPartRows)}, region));
  }
  if (history.film_usable() && can_reproject(history.film_pose())) {
    slot_ = history.take_slot(film_samples);
  } else {
    prepare_reprojection();
  }
}

void HistoryTransfer::prepare_reprojection() {
  std::vector<PictureSource> sources;
  for (int i = 0; i < FilmHistory::kSources; ++i) {
    const PictureHistory::Slot& slot = history_.slot(i);
    if (slot.valid && can_reproject(pose_))
      sources.push_back({slot.pose, &film_.history()->source(i), slot.swapped != history_.film_swapped()});
  }
  reprojection_ = std::make_unique<Reprojection>(scene_, film_, region_, pose_, filter_, std::move(sources));
}

void HistoryTransfer::run(int sweep, std::size_t part) {
  ReprojectionStats stats;
  switch (kind(sweep)) {
    case Sweep::gather:
      film_.history()->source(slot_).gather(film_, windows_[part], region_);
      return;
    case Sweep::centres:
      reprojection_->find_centres(windows_[part], stats);
      break;
    case Sweep::carry:
      reprojection_->carry(windows_[part], stats);
      break;
  }
  const std::lock_guard lock(mutex_);
  stats_.add(stats);
}

ReprojectionStats HistoryTransfer::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

void HistoryTransfer::finish_sweep(int sweep) {
  switch (kind(sweep)) {
    case Sweep::gather:
      history_.slot_complete(slot_);
      history_.film_overwritten();
      prepare_reprojection();
      return;
    case Sweep::centres:
      return;
    case Sweep::carry:
      history_.film_complete(pose_);
      return;
  }
}

}  // namespace helio
