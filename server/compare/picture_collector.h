// Receives the frames of a compared mode: the newest whole picture, and how its frame ended.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/picture_view.h"
#include "renderer/frame/frame_sink.h"

namespace helio {

// Three planes of floats, row-major, top row first.
struct Picture {
  int width = 0, height = 0;
  std::vector<float> channels[3];

  Picture() = default;
  Picture(int w, int h);
  PictureView view() const { return {width, height, {channels[0].data(), channels[1].data(), channels[2].data()}}; }
};

class PictureCollector final : public FrameSink {
 public:
  // display: the layer of that name in place of radiance, and its error.
  PictureCollector(int width, int height, bool display);

  struct Frame {
    FrameBegin begin;
    FrameEnd end;
  };
  // Waits for the end of the film's frame of this revision, or, with `preview`, of the preview of the view of this id;
  // `idle` is called about every 0.25 s. Nothing: cancelled.
  std::optional<Frame> wait_for_film(std::uint64_t revision, const CancelToken& cancel,
                                     const std::function<void()>& idle);
  std::optional<Frame> wait_for_preview(std::uint64_t view_id, const CancelToken& cancel,
                                        const std::function<void()>& idle);

  // Of the frame that was waited for, until the next one of its kind begins.
  const Picture& picture() const { return picture_; }
  const Picture& preview() const { return preview_; }
  // Of the film's mean; without pixels: not asked for.
  const Picture& variance() const { return variance_; }
  const std::vector<float>& samples() const { return samples_; }  // of each pixel; empty: not asked for
  // Root of the mean square of display.error; none: not a display picture, or a value is not finite.
  std::optional<double> display_error() const;

  void frame_begun(const FrameBegin& begin) override;
  void tile_ready(FrameTile tile) override;
  void frame_ended(const FrameEnd& end) override;

 private:
  template <class Is>
  std::optional<Frame> wait(const std::optional<Frame>& frame, const Is& is, const CancelToken& cancel,
                            const std::function<void()>& idle);

  const bool display_;
  Picture picture_, preview_, variance_;
  std::vector<float> samples_;
  double display_squares_ = 0;
  std::size_t display_pixels_ = 0;

  std::mutex mutex_;
  std::condition_variable ended_;
  FrameBegin film_begin_, preview_begin_;
  std::optional<Frame> film_end_, preview_end_;  // that ended last
};

}  // namespace helio
