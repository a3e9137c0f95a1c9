// A preview as published: Mrad 2022, "Image Upscaling for Ray Traced Foveated Rendering". A baseline, with its faults.
//
// In sweeps: where pixels lie in the kernel log-polar buffer, if the gaze has moved; one path for each pixel of the buffer
// and of a disk around the gaze; a radial blur of the buffer; back to the picture; temporal anti-aliasing outside the
// disk; with upscaling, all of it at 0.555 of the width and height, and a picture of full size gathered over time.
//
// What it is not: the paper shades as Whitted, with three shadow rays a light, which are paths here; and it upscales with
// a network that is not published (DLSS), for which temporal upsampling stands with the same inputs (upscaling.h). It does
// not say how the blur's Gaussian relates to its diameter (a deviation of a quarter of it here), what that diameter is in
// pictures of other sizes (it grows with them), over which distance blur and anti-aliasing fade in (a tenth of the disk's
// radius), nor in which units eq. 4.9 compares colours (x / (x + mean)). Its frame time is what a preview takes here, for
// previews come when the camera moves. A sample's motion is that of what it showed before only while the gaze rests: of a
// gaze that moves it has no samples at the same points.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/preview/paper/kernel_log_polar.h"
#include "renderer/preview/paper/paper_history.h"
#include "renderer/preview/preview_history.h"
#include "renderer/preview/preview_maker.h"
#include "renderer/preview/preview_target.h"
#include "renderer/preview/surface_pass.h"
#include "renderer/trace/camera/camera_projection.h"

namespace helio {

class PaperPreview final : public PreviewMaker {
 public:
  // Of the render resolution over the picture's, along either axis.
  static constexpr double kUpscaledFrom = 0.555;

  // history: made for published previews, of the film's size; nobody else uses it until the sweeps are over or given up.
  // Precondition: the target has a gaze and what is published.
  PaperPreview(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
               std::shared_ptr<const CancelToken> cancel);

  int sweeps() const override { return int(sweeps_.size()); }
  std::size_t parts() const override;
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void resolve(const PixelRect& window, std::vector<float> (&display)[3]) const override;

 private:
  enum class Sweep { places, trace, blur, remap, antialias, upscale };

  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }
  std::size_t sample_index(int column, int row) const {
    return std::size_t(row) * std::size_t(map_.columns()) + std::size_t(column);
  }
  std::size_t disk_index(int x, int y) const {
    return std::size_t(map_.columns()) * std::size_t(map_.rows()) +
           std::size_t(y - disk_.y0) * std::size_t(disk_.width()) + std::size_t(x - disk_.x0);
  }
  double from_gaze(int x, int y) const;  // of a pixel's centre
  bool in_disk(int x, int y) const { return from_gaze(x, y) < radius_; }
  float beyond_disk(double distance) const;  // 0 in the disk, 1 from a tenth of its radius on
  double blur_at(double distance) const;

  void find_places(const PixelRect& window);
  void trace_column(int column, TraceStats& stats);
  struct Mean {
    double sum = 0;
    std::size_t count = 0;
  };
  void trace_block(const PixelRect& block, Mean& mean, TraceStats& stats);
  void trace(std::span<const std::size_t> wanted, double detail_bias, Mean& mean, TraceStats& stats);
  void blur_column(int column);
  void blur_rows(std::size_t part);
  void remap(const PixelRect& window);
  V2f motion_of(std::size_t sample) const;
  bool shows_other(const PaperSample& sample, float x, float y) const;
  void antialias(const PixelRect& window);
  float tone(const Rgb& color) const;
  void complete();

  std::shared_ptr<PreviewHistory> history_;
  PaperHistory& paper_;
  PreviewTarget target_;
  std::shared_ptr<const CancelToken> cancel_;
  const PublishedFoveation published_;
  double scale_x_, scale_y_;  // pixels rendered over those of the film
  int width_, height_;        // of the render resolution
  PixelRect region_;          // of it
  KernelLogPolar map_;
  double radius_;
  PixelRect disk_;   // the window that its pixels lie in
  int first_column_;  // of the buffer, that is traced
  SubpixelJitter jitter_;
  double begun_s_;
  bool has_history_, same_samples_;  // shown before | its samples are those of the same points
  CameraProjection here_;
  std::optional<CameraProjection> there_;
  std::vector<PixelRect> windows_, blocks_, film_windows_;
  std::vector<Sweep> sweeps_;
  int current_ = 0;
  std::vector<Mean> means_;  // luminance of the new samples, by part
  float mean_ = 0;
};

}  // namespace helio
