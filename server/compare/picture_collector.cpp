#include "server/compare/picture_collector.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "renderer/base/clock.h"

namespace helio {
namespace {

constexpr std::chrono::milliseconds kLook{5};  // for a cancel
constexpr double kIdle = 0.25;

void copy_rows(const std::vector<float>& tile, const PixelRect& window, int width, std::vector<float>& plane) {
  const auto columns = std::size_t(window.width());
  for (int y = window.y0; y < window.y1; ++y) {
    const auto from = tile.begin() + std::ptrdiff_t(std::size_t(y - window.y0) * columns);
    std::copy(from, from + std::ptrdiff_t(columns),
              plane.begin() + std::ptrdiff_t(std::size_t(y) * std::size_t(width) + std::size_t(window.x0)));
  }
}

}  // namespace

Picture::Picture(int w, int h) : width(w), height(h) {
  for (auto& channel : channels) channel.resize(view().pixels());
}

PictureCollector::PictureCollector(int width, int height, bool display) : display_(display), picture_(width, height) {}

void PictureCollector::frame_begun(const FrameBegin& begin) {
  if (begin.preview) {
    preview_begin_ = begin;
    if (preview_.width == 0) preview_ = Picture(picture_.width, picture_.height);
    return;
  }
  film_begin_ = begin;
  display_squares_ = 0;
  display_pixels_ = 0;
}

void PictureCollector::tile_ready(FrameTile tile) {
  if (!tile.final) return;
  const ResolvedTile& pixels = tile.pixels;
  for (int c = 0; c < 3; ++c) {
    Picture& picture = tile.preview ? preview_ : picture_;
    copy_rows(display_ || tile.preview ? pixels.display[c] : pixels.radiance[c], pixels.window, picture.width,
              picture.channels[c]);
  }
  if (tile.preview) return;
  if (!pixels.variance[0].empty()) {
    if (variance_.width == 0) variance_ = Picture(picture_.width, picture_.height);
    for (int c = 0; c < 3; ++c) copy_rows(pixels.variance[c], pixels.window, picture_.width, variance_.channels[c]);
  }
  if (!pixels.samples.empty()) {
    samples_.resize(picture_.view().pixels());
    copy_rows(pixels.samples, pixels.window, picture_.width, samples_);
  }
  for (const float error : pixels.display_error) display_squares_ += double(error) * double(error);
  display_pixels_ += pixels.display_error.size();
}

void PictureCollector::frame_ended(const FrameEnd& end) {
  const std::lock_guard lock(mutex_);
  if (end.reason == FrameEndReason::preview || end.tag.same_frame(preview_begin_.tag)) {
    preview_end_ = Frame{preview_begin_, end};
  } else {
    film_end_ = Frame{film_begin_, end};
  }
  ended_.notify_all();
}

std::optional<double> PictureCollector::display_error() const {
  const double mean = display_pixels_ > 0 ? display_squares_ / double(display_pixels_) : NAN;
  if (!display_ || !std::isfinite(mean)) return std::nullopt;
  return std::sqrt(mean);
}

template <class Is>
std::optional<PictureCollector::Frame> PictureCollector::wait(const std::optional<Frame>& frame, const Is& is,
                                                              const CancelToken& cancel,
                                                              const std::function<void()>& idle) {
  double told = now_s();
  std::unique_lock lock(mutex_);
  for (;;) {
    if (cancel.cancelled()) return std::nullopt;
    if (frame && is(*frame)) return frame;
    ended_.wait_for(lock, kLook);
    if (now_s() - told < kIdle) continue;
    told = now_s();
    lock.unlock();
    idle();
    lock.lock();
  }
}

std::optional<PictureCollector::Frame> PictureCollector::wait_for_film(std::uint64_t revision,
                                                                       const CancelToken& cancel,
                                                                       const std::function<void()>& idle) {
  return wait(
      film_end_, [&](const Frame& f) { return f.end.tag.revision == revision; }, cancel, idle);
}

std::optional<PictureCollector::Frame> PictureCollector::wait_for_preview(std::uint64_t view_id,
                                                                          const CancelToken& cancel,
                                                                          const std::function<void()>& idle) {
  return wait(
      preview_end_, [&](const Frame& f) { return f.end.tag.view_id == view_id; }, cancel, idle);
}

}  // namespace helio
