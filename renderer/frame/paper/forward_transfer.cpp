#include "renderer/frame/paper/forward_transfer.h"

#include <utility>

#include "renderer/film/core/film_windows.h"
#include "renderer/frame/paper/paper_film.h"
#include "renderer/frame/picture_state.h"

namespace helio {
namespace {

// Of a sweep's parts: at most some milliseconds each.
constexpr int kPartRows = kFilmBlock, kPartColumns = 8 * kFilmBlock;

}  // namespace

ForwardTransfer::ForwardTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                                 PictureHistory& history, const CameraPose& pose, const PixelFilter& filter,
                                 float max_error)
    : film_(film),
      left_(paper_film(film).first_hits()->left()),
      history_(history),
      pose_(pose),
      windows_(cut_aligned(region, kPartColumns, kPartRows)) {
  const CameraPose* from = history.film_usable() ? &history.film_pose() : (left_.pose ? &*left_.pose : nullptr);
  if (!from || !can_reproject_forward(*from, filter) || !can_reproject_forward(pose, filter)) {
    kinds_.push_back(Sweep::clear);
    return;
  }
  kinds_ = {history.film_usable() ? Sweep::gather : Sweep::withdraw, Sweep::project, Sweep::carry};
  reprojection_ = std::make_unique<ForwardReprojection>(std::move(scene), film, region, *from, pose, max_error);
}

void ForwardTransfer::run(int sweep, std::size_t part, TraceStats&) {
  const PixelRect& window = windows_[part];
  ReprojectionStats stats;
  switch (kinds_[std::size_t(sweep)]) {
    case Sweep::gather:
      left_.gather(film_, window);
      return;
    case Sweep::withdraw:
      left_.withdraw_bids(window);
      return;
    case Sweep::project:
      reprojection_->project(window, stats);
      break;
    case Sweep::carry:
      reprojection_->carry(window, stats);
      break;
    case Sweep::clear:
      film_.clear(window);
      return;
  }
  add_stats(stats);
}

void ForwardTransfer::finish_sweep(int sweep) {
  switch (kinds_[std::size_t(sweep)]) {
    case Sweep::gather:
      left_.pose = history_.film_pose();
      history_.film_overwritten();
      return;
    case Sweep::withdraw:
    case Sweep::project:
      return;
    case Sweep::carry:
    case Sweep::clear:
      left_.pose.reset();
      history_.film_complete(nullptr, pose_);  // edits of the scene begin anew
      note_complete();
      return;
  }
}

// Nothing of it is reviewed, and counts fill up whatever is missing (Algorithm 2).
void ForwardTransfer::note(PictureState& picture) {
  picture.state.reproject_due = false;
  picture.state.carried = false;
  picture.state.fill = stats().carried > 0;
}

}  // namespace helio
