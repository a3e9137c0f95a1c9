#include "renderer/frame/preview_frames.h"

#include "renderer/frame/integrate_function.h"
#include "renderer/preview/paper/paper_history.h"

namespace helio {

bool PreviewFrames::suits(const std::shared_ptr<PreviewHistory>& history, const RenderSettings& settings) {
  if (!(settings.preview.rate > 0)) return true;
  return history && history->width() == settings.width && history->height() == settings.height &&
         bool(history->published) == as_published(settings);
}

std::pair<std::shared_ptr<PreviewHistory>, std::shared_ptr<PreviewHistory>> PreviewFrames::set(
    double rate, std::shared_ptr<PreviewHistory> fresh) noexcept {
  clock.set_rate(rate);
  if (!clock.on()) return {std::exchange(history_, nullptr), std::exchange(next_history_, nullptr)};
  if (fresh) next_history_.swap(fresh);
  return {std::move(fresh), nullptr};
}

std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>> PreviewFrames::begin(
    const FrameRecord& frame, std::shared_ptr<const RenderScene> scene, std::shared_ptr<const CancelToken> cancel,
    const Film& film, const RestingFilm* rest) {
  const FrameBegin& begin = frame.begin;
  std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>> retired;
  if (next_history_) retired.first = std::exchange(history_, std::move(next_history_));
  retired.second = release_stage();
  if (std::exchange(forget_due_, false)) history_->forget();
  if (std::exchange(broken_, false)) pipeline = FramePipeline(threads_, piece_seconds_);
  if (pipeline.grid().region() != begin.region) pipeline.set_grid(begin.region, tile_size_);

  PreviewTarget target;
  target.camera = begin.camera;
  target.path = path_settings(begin.settings);
  target.filter = begin.settings.filter;
  target.region = begin.region;
  target.density = gaze_density(begin.settings, begin.gaze);
  target.upscaling = begin.settings.preview.upscaling;
  if (history_->published) {
    target.published = begin.settings.foveation.published;
    // Nobody looks anywhere in particular: the middle is where the paper has its gaze.
    target.gaze = begin.gaze.value_or(Gaze{0.5 * begin.settings.width, 0.5 * begin.settings.height});
  }
  target.until_s = frame.begun_s + begin.settings.preview.budget_s - output_s_;
  const bool fits = rest && rest->film.width() == history_->width() && rest->film.height() == history_->height();
  if (fits && history_->shows(rest->scene, rest->camera, rest->region)) {
    target.film = &rest->film;
    target.display = rest->display;
  }
  target.scene = std::move(scene);
  stage_ = std::make_shared<PreviewStage>(history_, std::move(target), std::move(cancel));

  FramePlan plan;
  plan.revision = begin.tag.revision;
  plan.before = {StageId::preview};
  plan.publish = Publish::round;  // not final: that would clear what the film lacks
  plan.end = FrameEndReason::preview;
  pipeline.begin_frame();
  pipeline.start(plan, film, {{stage_}, {}});
  return retired;
}

void PreviewFrames::note_end() {
  const double seconds = pipeline.seconds(StageId::resolve);
  output_s_ = output_s_ > 0 ? output_s_ + 0.5 * (seconds - output_s_) : seconds;
}

std::size_t PreviewFrames::bytes() const {
  return (history_ ? history_->bytes() : 0) + (next_history_ ? next_history_->bytes() : 0) + pipeline.grid().bytes();
}

}  // namespace helio
