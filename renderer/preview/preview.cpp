#include "renderer/preview/preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "renderer/base/check.h"
#include "renderer/base/clock.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/preview/coarse_surfaces.h"
#include "renderer/preview/film_capture.h"
#include "renderer/preview/sparse_surfaces.h"

namespace helio {
namespace {

constexpr int kWindowWidth = 128, kWindowHeight = 32;
// Side of the parts in which surfaces are as fine or as coarse as a gaze asks for.
constexpr int kFoveatedPart = 32;
// Paths of a part: a group of the kernels.
constexpr std::size_t kPathsAPart = 256;
// Parts that are traced whatever the time, for what has come into view would have no light at all.
constexpr std::size_t kLeastParts = 8;
// Paths of a preview at most, of its pixels: more would not fit its memory.
constexpr double kMostPaths = 0.25;
// Levels of the filter at most; in pairs.
constexpr int kMostLevels = 4;
// Luminance of a fresh sample's light beyond so many times the mean is cut off: it would shine for seconds.
constexpr float kMostOverMean = 16;

void blend(double& mean, double value) {
  mean = mean > 0 ? mean + 0.25 * (value - mean) : value;
}

}  // namespace

Preview::Preview(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
                 std::shared_ptr<const CancelToken> cancel)
    : history_(std::move(history)),
      target_(std::move(target)),
      cancel_(std::move(cancel)),
      view_{target_.scene, target_.camera, target_.region},
      surface_camera_(target_.camera, history_->width(), history_->height(), target_.scene->origin()),
      camera_(target_.camera, history_->width(), history_->height(), target_.scene->origin(), target_.filter),
      windows_(cut_aligned(target_.region, kWindowWidth, kWindowHeight)) {
  target_.path.integrator = Integrator::path;
  target_.path.technique.reset();
  history_->current.forget();
  if (target_.film) history_->rest.forget();  // until it has been captured as a whole
  colors_before_ = history_->colors_of_last;
  history_->colors_of_last = false;
  ++history_->frame;
  wanted_.resize(windows_.size());
  if (history_->colored_scene.lock() != target_.scene) sweeps_.push_back(Sweep::colors);
  if (target_.film && history_->density_of_last) sweeps_.push_back(Sweep::refine);
  if (target_.film) sweeps_.push_back(Sweep::capture);
  sweeps_.push_back(Sweep::surfaces);
  // Where nothing is captured, what was captured before stays what is looked up first.
  if (!target_.film) begin_surfaces();
}

void Preview::begin_surfaces() {
  lookup_.emplace(view_, *history_);
  const PreviewBuffer& newest = target_.film ? history_->rest : history_->last;
  if (colors_before_ && newest.known && newest.scene.lock() == target_.scene) before_ = &newest;
  std::swap(history_->colors, history_->colors_before);
}

void Preview::refine(const PixelRect& window, TraceStats& stats) {
  const Camera camera(history_->last.camera, history_->width(), history_->height(), target_.scene->origin());
  const SurfaceColors* const colors = camera.pinhole() ? history_->surface_colors.get() : nullptr;
  const SurfacePass surfaces(*target_.scene, camera, colors, *history_);
  for (const PixelRect& part : cut_aligned(window, kFoveatedPart, kFoveatedPart)) {
    if (history_->density_of_last->most_in(part) > CoarseSurfaces::kFullDensity) continue;
    for (const PixelRect& block : cut_aligned(part, kPathGroupSize, kPathGroupSize)) stats.rays += surfaces.run(block);
    take_light(part);
  }
}

// Of the preview before, for surfaces that have been found anew.
void Preview::take_light(const PixelRect& part) {
  for (int y = part.y0; y < part.y1; ++y) {
    for (int x = part.x0; x < part.x1; ++x) {
      PreviewPixel &found = history_->current.pixels[history_->index(x, y)],
                   &last = history_->last.pixels[history_->index(x, y)];
      const float slack = found.depth * 0.02f;
      if (found.samples != kExactSamples && last.samples != kExactSamples && last.lit &&
          same_surface(last, found, found.depth, slack)) {
        found.set_light(last.unpacked_light());
        found.samples = last.samples;
      }
      last = found;
    }
  }
}

void Preview::find_surfaces(const PixelRect& window, TraceStats& stats) {
  // Through a lens a pixel mixes many points of a texture.
  const SurfaceColors* const colors = surface_camera_.pinhole() ? history_->surface_colors.get() : nullptr;
  const SurfacePass surfaces(*target_.scene, surface_camera_, colors, *history_);
  std::optional<SparseSurfaces> sparse;
  if (target_.upscaling) sparse.emplace(surfaces, view_, before_, *history_);
  if (target_.density) {
    const CoarseSurfaces coarse(surfaces, sparse ? &*sparse : nullptr, *lookup_, *history_);
    for (const PixelRect& part : cut_aligned(window, kFoveatedPart, kFoveatedPart))
      stats.rays += coarse.run(part, *target_.density);
  } else if (sparse) {
    stats.rays += sparse->run(window);
    lookup_->run(window);
  } else {
    for (const PixelRect& block : cut_aligned(window, kPathGroupSize, kPathGroupSize))
      stats.rays += surfaces.run(block);
    lookup_->run(window);  // not block by block: long rows are what processors fetch ahead
  }
}

std::size_t Preview::parts() const {
  switch (sweeps_[std::size_t(current_)]) {
    case Sweep::colors:
      return 1;
    case Sweep::refine:
    case Sweep::capture:
    case Sweep::surfaces:
    case Sweep::filter:
      return windows_.size();
    case Sweep::samples:
      return (chosen_.size() + kPathsAPart - 1) / kPathsAPart;
  }
  return 0;
}

void Preview::run(int sweep, std::size_t part, TraceStats& stats) {
  double none = 0;
  sweep_begun_s_.compare_exchange_strong(none, now_s());
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::colors:
      history_->surface_colors = std::make_shared<const SurfaceColors>(*target_.scene);
      history_->colored_scene = target_.scene;
      return;
    case Sweep::refine:
      return refine(windows_[part], stats);
    case Sweep::capture:
      return capture_film(*target_.film, target_.display, windows_[part], *history_);
    case Sweep::surfaces: {
      find_surfaces(windows_[part], stats);
      wanted_[part] =
          SampleOrder::find(windows_[part], *history_, target_.density ? &*target_.density : nullptr);
      return;
    }
    case Sweep::samples:
      return trace(part, stats);
    case Sweep::filter:
      if (unsettled_[part] > 0) filter_->run(windows_[part], sweep - first_level_);
      return;
  }
}

void Preview::finish_sweep(int sweep) {
  const double seconds = sweep_begun_s_ > 0 ? now_s() - sweep_begun_s_ : 0;
  sweep_begun_s_ = 0;
  PreviewCosts& costs = history_->costs;
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::colors:
    case Sweep::refine:
      break;
    case Sweep::capture:
      history_->rest.take_view(history_->last);
      begin_surfaces();
      break;
    case Sweep::surfaces:
      plan_rest();
      break;
    case Sweep::samples:
      if (traced_ > 0) blend(costs.sample, seconds / double(traced_));
      finish_samples();
      break;
    case Sweep::filter: {
      if (filtered_ > 0) blend(costs.filter, seconds / double(filtered_));
      break;
    }
  }
  ++current_;
  if (current_ == sweeps()) complete();
}

// What fits into the time that is left: paths, and levels of the filter, which are given up first.
void Preview::plan_rest() {
  std::array<std::size_t, std::size(kFilterLimits)> below{};
  for (const SampleOrder::Wanted& wanted : wanted_) {
    for (std::size_t k = 0; k < below.size(); ++k) below[k] += wanted.below[k];
  }
  const std::size_t gaps = below.back();
  if (below.front() > 0) {
    const PreviewCosts& costs = history_->costs;
    const double left = std::max(target_.until_s - now_s(), 0.0);
    // The filter is worth no more than half of the time that is left: first levels are given up, then pixels. Those
    // with the fewest samples, and gaps, are wider apart than two levels reach.
    int levels = kMostLevels;
    std::size_t limit = 0;
    const auto filtering = [&] { return levels * costs.filter * double(below[limit]); };
    while (filtering() > 0.5 * left && (levels > 2 || limit + 1 < below.size())) {
      if (levels > 2) {
        levels -= 2;
      } else {
        levels = kMostLevels;
        ++limit;
      }
    }
    if (limit + 1 == below.size()) levels = kMostLevels;
    if (below[limit] == 0) levels = 0;
    filtered_ = below[limit];
    for (const SampleOrder::Wanted& wanted : wanted_) unsettled_.push_back(wanted.below[limit]);
    const double most_paths = kMostPaths * double(target_.region.area());
    const double for_paths = std::max(left - filtering(), 0.0);
    const double paths = std::max(costs.sample > 0 ? for_paths / costs.sample : double(16 * kPathsAPart),
                                  gaps > 0 ? double(kLeastParts * kPathsAPart) : 0.0);
    chosen_ = SampleOrder::merge(wanted_, std::size_t(std::min(paths, most_paths)));
    if (!chosen_.empty()) {
      sweeps_.push_back(Sweep::samples);
      const std::size_t parts = (chosen_.size() + kPathsAPart - 1) / kPathsAPart;
      sums_.assign(parts, Rgb(0, 0, 0));
      counts_.assign(parts, 0);
    }
    first_level_ = sweeps();
    sweeps_.insert(sweeps_.end(), std::size_t(levels), Sweep::filter);
    filter_.emplace(view_, kFilterLimits[limit], *history_);
  }
  wanted_ = {};
}

void Preview::trace(std::size_t part, TraceStats& stats) {
  if (part >= kLeastParts && now_s() >= target_.until_s) return;
  const std::size_t first = part * kPathsAPart, count = std::min(kPathsAPart, chosen_.size() - first);
  const std::span<const PixelPosition> pixels(chosen_.data() + first, count);
  Rgb radiance[kPathsAPart];
  if (!trace_pixels(*target_.scene, camera_, target_.path, pixels, history_->frame, *cancel_, radiance, stats)) return;
  traced_ += count;
  const float mean = luminance(history_->mean_light);
  for (std::size_t k = 0; k < count; ++k) {
    const Rgb& sample = radiance[k];
    if (!is_finite(sample)) {
      ++stats.invalid_samples;
      continue;
    }
    const std::size_t i = history_->index(pixels[k].x, pixels[k].y);
    PreviewPixel& pixel = history_->current.pixels[i];
    Rgb light = sample / unpack_color(history_->colors[i]);
    const float most = kMostOverMean * mean, bright = luminance(light);
    if (mean > 0 && bright > most) light *= most / bright;
    sums_[part] += light;
    ++counts_[part];
    const float before = pixel.samples;
    pixel.set_light((pixel.unpacked_light() * before + light) / (before + 1));
    // A gap's sample counts for none until it has been filtered with those around it: alone it would be a dot.
    if (pixel.samples > 0) pixel.set_samples(before + 1);
  }
}

void Preview::finish_samples() {
  Rgb sum(0, 0, 0);
  std::size_t count = 0;
  for (std::size_t part = 0; part < sums_.size(); ++part) {
    sum += sums_[part];
    count += counts_[part];
  }
  if (count > 0 && is_finite(sum)) history_->mean_light = sum / float(count);
}

void Preview::complete() {
  history_->density_of_last = target_.density;
  history_->current.set_view(view_);
  std::swap(history_->current, history_->last);
  history_->colors_of_last = true;
}

void Preview::resolve(const PixelRect& window, std::vector<float> (&display)[3]) const {
  for (std::vector<float>& plane : display) plane.resize(std::size_t(window.area()));
  std::size_t to = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++to) {
      const std::size_t i = history_->index(x, y);
      const Rgb radiance = history_->last.pixels[i].unpacked_light() * unpack_color(history_->colors[i]);
      for (int c = 0; c < 3; ++c) display[c][to] = radiance[c];
    }
  }
}

}  // namespace helio
