// One mode with one seed: a session of its own, whose camera and budget the comparison moves.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "server/compare/comparison_request.h"
#include "server/compare/picture_collector.h"
#include "server/sessions/render_context.h"

namespace helio {

// What one picture took.
struct PictureCost {
  double seconds = 0;       // wall time
  double samples = 0;       // fresh ones per pixel, the mean
  double others_share = 0;  // processor time that others took meanwhile (CompareUnit.others_share), [0, 1]
  FrameProgress progress;   // at the end
};

class ComparedSession {
 public:
  // resource_exhausted: max_memory.
  // `more`: ResolveChannels beside those that the mode needs.
  static Result<std::unique_ptr<ComparedSession>> create(const RenderContext::Resources& resources,
                                                         std::shared_ptr<const LoadedScene> scene,
                                                         const ComparedMode& mode, std::uint64_t seed,
                                                         unsigned more = 0,
                                                         const std::optional<Gaze>& gaze = {});

  // While this session renders no other one is, for so many seconds of its life altogether.
  void hold_others(double seconds) { hold_left_s_ = seconds; }

  // Another view, rendered to the budget from its start. What the mode carries over is. `idle` is called four times a
  // second with the progress.
  using Idle = std::function<void(const FrameProgress&)>;
  Result<PictureCost> render(const CameraPose& view, const Budget& budget, const CancelToken& cancel, const Idle& idle);
  // The same picture goes on: budgets of samples count from its start, those of time from now. The cost is this part's;
  // its progress the whole picture's.
  Result<PictureCost> go_on(const Budget& budget, const CancelToken& cancel, const Idle& idle);
  // The preview of another view, from its update on.
  Result<PictureCost> preview(const CameraPose& view, const CancelToken& cancel, const Idle& idle);

  const Picture& picture() const { return previews_ ? collector_->preview() : collector_->picture(); }
  const std::vector<float>& samples() const { return collector_->samples(); }
  const Picture& variance() const { return collector_->variance(); }
  // Of the picture's film.
  const FrameBegin& begin() const { return begin_; }
  // The standard error that the mode tells of its picture; none: it knows none.
  std::optional<double> told_rmse() const { return told_rmse_; }

 private:
  ComparedSession() = default;
  template <class Wait>
  Result<PictureCost> measure(RenderLoop::Update update, const Idle& idle, const Wait& wait);
  Result<PictureCost> film(RenderLoop::Update update, const CancelToken& cancel, const Idle& idle);
  View next_view(const CameraPose& camera);

  std::shared_ptr<PictureCollector> collector_;
  std::shared_ptr<RenderContext> rendering_;
  bool display_ = false, previews_ = false;
  std::uint64_t view_id_ = 0;
  std::optional<Gaze> gaze_;
  double time_s_ = 0;
  RenderEngine* engine_ = nullptr;
  double hold_left_s_ = 0;
  FrameBegin begin_;
  std::optional<double> told_rmse_;
};

}  // namespace helio
