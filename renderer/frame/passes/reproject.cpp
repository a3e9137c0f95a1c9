#include "renderer/frame/passes/reproject.h"

#include <algorithm>

#include "renderer/film/film_history.h"
#include "renderer/film/film_windows.h"

namespace helio {
namespace {

// A source that knows this share of its picture's samples of a pixel need not be bettered by another.
constexpr double kEnough = 0.5;
// Of a sweep's parts: about a millisecond each.
constexpr int kPartRows = kFilmBlock, kPartColumns = 16 * kFilmBlock;

}  // namespace

void PictureHistory::forget() {
  for (Slot& slot : slots_) slot.valid = false;
  film_.valid = false;
  copy_pose_.reset();
  generation = 0;
}

int PictureHistory::take_slot(double samples) {
  const Slot& anchor = slots_[anchor_];
  const int i = 1 - anchor_;
  promoted_ = !anchor.valid || samples >= kAnchorShare * anchor.samples;
  slots_[i] = {false, film_.pose, samples, film_.swapped};
  return i;
}

void PictureHistory::slot_complete(int slot) {
  slots_[slot].valid = true;
  if (promoted_) anchor_ = slot;
}

HistoryTransfer::HistoryTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                                 PictureHistory& history, const CameraPose& pose, const PixelFilter& filter,
                                 double film_samples)
    : scene_(std::move(scene)), film_(film), region_(region), history_(history), pose_(pose), filter_(filter) {
  windows_ = cut_aligned(region, kPartColumns, kPartRows);
  if (history.film_usable() && can_reproject(history.film_pose(), filter)) {
    slot_ = history.take_slot(film_samples);
  } else {
    prepare_reprojection();
  }
}

void HistoryTransfer::prepare_reprojection() {
  std::vector<PictureSource> sources;
  for (int k = 0; k < FilmHistory::kSources && can_reproject(pose_, filter_); ++k) {
    const int i = k == 0 ? history_.anchor() : 1 - history_.anchor();
    const PictureHistory::Slot& slot = history_.slot(i);
    if (!slot.valid) continue;
    const auto enough = float(kEnough * slot.samples);
    sources.push_back({slot.pose, &film_.history()->source(i), enough, slot.swapped != history_.film_swapped()});
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
  note(stats);
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
