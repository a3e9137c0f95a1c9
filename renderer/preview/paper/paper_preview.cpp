#include "renderer/preview/paper/paper_preview.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/base/check.h"
#include "renderer/base/clock.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/preview/paper/upscaling.h"

namespace helio {
namespace {

constexpr int kWindowWidth = 128, kWindowHeight = 32;
// Rays go through the middle of squares of a film that is so much finer, and through any point of them.
constexpr int kFine = 16;
// Rows of the buffer that a part blurs.
constexpr int kRowsAPart = 16;
// Over which share of the disk's radius blur and anti-aliasing fade in.
constexpr double kFade = 0.1;

const Rgb kNone(std::numeric_limits<float>::quiet_NaN(), 0, 0);

double clamped(double value) {
  return std::clamp(value, 0.0, 1.0);
}

PixelRect scaled(const PixelRect& r, double x, double y, int width, int height) {
  return intersect({int(std::floor(r.x0 * x)), int(std::floor(r.y0 * y)), int(std::ceil(r.x1 * x)),
                    int(std::ceil(r.y1 * y))},
                   {0, 0, width, height});
}

}  // namespace

PaperPreview::PaperPreview(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
                           std::shared_ptr<const CancelToken> cancel)
    : history_(std::move(history)),
      paper_(*history_->published),
      target_(std::move(target)),
      cancel_(std::move(cancel)),
      published_(*target_.published),
      width_(target_.upscaling ? std::max(int(kUpscaledFrom * history_->width()), 1) : history_->width()),
      height_(target_.upscaling ? std::max(int(kUpscaledFrom * history_->height()), 1) : history_->height()),
      map_(width_, height_, target_.gaze->x * width_ / history_->width(),
           target_.gaze->y * height_ / history_->height()),
      begun_s_(now_s()),
      here_(target_.camera, history_->width(), history_->height(), target_.scene->origin()) {
  target_.path.integrator = Integrator::path;
  target_.path.technique.reset();
  scale_x_ = double(width_) / history_->width();
  scale_y_ = double(height_) / history_->height();
  region_ = scaled(target_.region, scale_x_, scale_y_, width_, height_);
  radius_ = published_.disk * (published_.fixed_disk ? 0.5 * std::hypot(width_, height_) : map_.farthest());
  disk_ = intersect({int(std::floor(map_.gaze_x() - radius_)), int(std::floor(map_.gaze_y() - radius_)),
                     int(std::ceil(map_.gaze_x() + radius_)), int(std::ceil(map_.gaze_y() + radius_))},
                    region_);
  if (disk_.empty()) disk_ = {region_.x0, region_.y0, region_.x0, region_.y0};
  first_column_ = map_.first_column(radius_);
  if (published_.antialiasing || target_.upscaling) jitter_ = subpixel_jitter(paper_.picture, 1 / scale_x_);

  paper_.now.known = false;
  const PaperHistory::Side& before = paper_.before;
  has_history_ = before.known && before.scene.lock() == target_.scene && before.width == width_ &&
                 before.height == height_ && before.region == region_ && before.film_region == target_.region;
  same_samples_ = has_history_ && before.gaze_x == map_.gaze_x() && before.gaze_y == map_.gaze_y() &&
                  before.disk == disk_ && before.radius == radius_;
  if (has_history_)
    there_.emplace(before.camera, history_->width(), history_->height(), target_.scene->origin());

  windows_ = cut_aligned(region_, kWindowWidth, kWindowHeight);
  film_windows_ = cut_aligned(target_.region, kWindowWidth, kWindowHeight);
  if (!disk_.empty()) blocks_ = cut_aligned(disk_, kPathGroupSize, kPathGroupSize);
  const PaperHistory::PlacesOf places{width_, height_, map_.gaze_x(), map_.gaze_y(), region_};
  if (paper_.places_of != places) {
    paper_.places_of.reset();
    sweeps_.push_back(Sweep::places);
  }
  means_.resize(std::size_t(map_.columns() - first_column_) + blocks_.size());
  sweeps_.insert(sweeps_.end(), {Sweep::trace, Sweep::blur, Sweep::remap});
  if (published_.antialiasing) sweeps_.push_back(Sweep::antialias);
  if (target_.upscaling) sweeps_.push_back(Sweep::upscale);
}

double PaperPreview::from_gaze(int x, int y) const {
  return std::hypot(x + 0.5 - map_.gaze_x(), y + 0.5 - map_.gaze_y());
}

float PaperPreview::beyond_disk(double distance) const {
  return float(clamped((distance - radius_) / (kFade * radius_)));
}

double PaperPreview::blur_at(double distance) const {
  return map_.blur_diameter(distance) * beyond_disk(distance);
}

std::size_t PaperPreview::parts() const {
  switch (sweeps_[std::size_t(current_)]) {
    case Sweep::trace:
      return means_.size();
    case Sweep::blur:
      return std::size_t((map_.rows() + kRowsAPart - 1) / kRowsAPart);
    case Sweep::upscale:
      return film_windows_.size();
    case Sweep::places:
    case Sweep::remap:
    case Sweep::antialias:
      return windows_.size();
  }
  return 0;
}

void PaperPreview::run(int sweep, std::size_t part, TraceStats& stats) {
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::places:
      return find_places(windows_[part]);
    case Sweep::trace: {
      const std::size_t columns = std::size_t(map_.columns() - first_column_);
      if (part < columns) return trace_column(first_column_ + int(part), stats);
      return trace_block(blocks_[part - columns], means_[part], stats);
    }
    case Sweep::blur:
      return blur_rows(part);
    case Sweep::remap:
      return remap(windows_[part]);
    case Sweep::antialias:
      return antialias(windows_[part]);
    case Sweep::upscale: {
      const double jittered = published_.antialiasing ? radius_ : std::numeric_limits<double>::infinity();
      const UpscalingInput input{paper_.now.shown, paper_.motion, width_,        height_,       region_,  scale_x_,
                                 scale_y_,         jitter_,       map_.gaze_x(), map_.gaze_y(), jittered};
      return upscale(input, film_windows_[part], target_.region, history_->width(),
                     has_history_ ? &paper_.before.upscaled : nullptr, paper_.now.upscaled);
    }
  }
}

void PaperPreview::finish_sweep(int sweep) {
  switch (sweeps_[std::size_t(sweep)]) {
    case Sweep::places:
      paper_.places_of = PaperHistory::PlacesOf{width_, height_, map_.gaze_x(), map_.gaze_y(), region_};
      break;
    case Sweep::trace: {
      Mean all;
      for (const Mean& mean : means_) {
        all.sum += mean.sum;
        all.count += mean.count;
      }
      mean_ = all.count > 0 ? float(all.sum / double(all.count)) : 0;
      break;
    }
    default:
      break;
  }
  ++current_;
  if (current_ == sweeps()) complete();
}

void PaperPreview::find_places(const PixelRect& window) {
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const KernelLogPolar::Point at = map_.to_buffer(x + 0.5, y + 0.5);
      const auto share = [](double value, int of) {
        return std::uint32_t(std::clamp(value / of * 65536, 0.0, 65535.0));
      };
      paper_.places[index(x, y)] = share(at.x, map_.columns()) << 16 | share(at.y, map_.rows());
    }
  }
}

// A column of the buffer: all of its distance from the gaze.
void PaperPreview::trace_column(int column, TraceStats& stats) {
  std::vector<std::size_t> wanted;
  // So far beside the picture as a sample still counts for a pixel inside.
  const double margin =
      2 * std::max(map_.distance_at(column + 1) - map_.distance_at(column),
                   map_.distance_at(column + 1) * 2 * std::numbers::pi / map_.rows());
  for (int row = 0; row < map_.rows(); ++row) {
    PaperSample& sample = paper_.now.samples[sample_index(column, row)];
    const KernelLogPolar::Point at = map_.to_picture(column + 0.5 + jitter_.x, row + 0.5 + jitter_.y);
    sample.traced = false;
    sample.x = float(at.x / scale_x_);
    sample.y = float(at.y / scale_y_);
    const bool near = at.x > region_.x0 - margin && at.x < region_.x1 + margin && at.y > region_.y0 - margin &&
                      at.y < region_.y1 + margin;
    if (near) wanted.push_back(sample_index(column, row));
  }
  trace(wanted, map_.detail_bias(column + 0.5), means_[std::size_t(column - first_column_)], stats);
  blur_column(column);
}

void PaperPreview::trace_block(const PixelRect& block, Mean& mean, TraceStats& stats) {
  std::vector<std::size_t> wanted;
  for (int y = block.y0; y < block.y1; ++y) {
    for (int x = block.x0; x < block.x1; ++x) {
      PaperSample& sample = paper_.now.samples[disk_index(x, y)];
      sample.traced = false;
      // Without upscaling nothing would smooth the disk over time.
      sample.x = float((x + 0.5 + (target_.upscaling ? jitter_.x : 0)) / scale_x_);
      sample.y = float((y + 0.5 + (target_.upscaling ? jitter_.y : 0)) / scale_y_);
      if (in_disk(x, y)) wanted.push_back(disk_index(x, y));
    }
  }
  trace(wanted, KernelLogPolar::kBaseBias, mean, stats);
}

void PaperPreview::trace(std::span<const std::size_t> wanted, double detail_bias, Mean& mean, TraceStats& stats) {
  constexpr std::size_t kAtOnce = SurfacePass::kMostAtOnce;
  Camera camera(target_.camera, kFine * history_->width(), kFine * history_->height(), target_.scene->origin());
  // Eq. 4.1: the footprint's logarithm grows by the bias.
  camera.widen_cone(float(kFine / scale_x_ * std::exp2(detail_bias)));
  const SurfacePass surfaces(*target_.scene, camera, nullptr, *history_);
  for (std::size_t first = 0; first < wanted.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, wanted.size() - first);
    PixelPosition at[kAtOnce];
    PreviewPixel pixels[kAtOnce];
    std::uint32_t colors[kAtOnce];
    Rgb radiance[kAtOnce];
    for (std::size_t k = 0; k < count; ++k) {
      const PaperSample& sample = paper_.now.samples[wanted[first + k]];
      at[k] = {std::int32_t(std::floor(sample.x * kFine)), std::int32_t(std::floor(sample.y * kFine))};
    }
    surfaces.trace({at, count}, pixels, colors);
    stats.rays += count;
    if (!trace_pixels(*target_.scene, camera, target_.path, {at, count}, paper_.picture, *cancel_, radiance, stats))
      return;
    for (std::size_t k = 0; k < count; ++k) {
      PaperSample& sample = paper_.now.samples[wanted[first + k]];
      sample.surface = pixels[k];
      sample.traced = is_finite(radiance[k]);
      sample.light = sample.traced ? radiance[k] : Rgb(0, 0, 0);
      stats.invalid_samples += !sample.traced;
      if (!sample.traced) continue;
      mean.sum += luminance(sample.light);
      ++mean.count;
    }
  }
}

// Along the angle, which goes round.
void PaperPreview::blur_column(int column) {
  const double diameter = blur_at(map_.distance_at(column + 0.5));
  const int reach = std::min(int(0.5 * diameter), map_.rows() / 2);
  const float falloff = diameter > 0 ? float(8 / (diameter * diameter)) : 0;  // deviation: a quarter of it
  for (int row = 0; row < map_.rows(); ++row) {
    BlurSum& sum = paper_.sums[sample_index(column, row)];
    sum = {};
    for (int k = -reach; k <= reach; ++k) {
      const int from = (row + k + map_.rows()) % map_.rows();
      const PaperSample& sample = paper_.now.samples[sample_index(column, from)];
      if (!sample.traced) continue;
      const float weight = std::exp(-falloff * float(k * k));
      sum.light += sample.light * weight;
      sum.weight += weight;
    }
  }
}

// Along the distance; into the samples' own light, which nobody needs any more.
void PaperPreview::blur_rows(std::size_t part) {
  const int row0 = int(part) * kRowsAPart, row1 = std::min(row0 + kRowsAPart, map_.rows());
  for (int column = first_column_; column < map_.columns(); ++column) {
    const double diameter = blur_at(map_.distance_at(column + 0.5));
    const int reach = int(0.5 * diameter);
    const float falloff = diameter > 0 ? float(8 / (diameter * diameter)) : 0;
    const int first = std::max(column - reach, first_column_), last = std::min(column + reach, map_.columns() - 1);
    for (int row = row0; row < row1; ++row) {
      BlurSum all;
      for (int from = first; from <= last; ++from) {
        const BlurSum& sum = paper_.sums[sample_index(from, row)];
        const float weight = std::exp(-falloff * float((from - column) * (from - column)));
        all.light += sum.light * weight;
        all.weight += sum.weight * weight;
      }
      PaperSample& sample = paper_.now.samples[sample_index(column, row)];
      if (all.weight > 0) sample.light = all.light * (1 / all.weight);
    }
  }
}

// Eq. 4.6, in pixels of the render resolution: from where a sample is to where what it shows was. As published, of what
// the same sample showed before.
V2f PaperPreview::motion_of(std::size_t s) const {
  if (!has_history_) return {0, 0};
  const auto projected = [](const CameraProjection& from, const CameraProjection& to, const PaperSample& sample) {
    if (!std::isfinite(sample.surface.depth))
      return to.direction(from.orthographic() ? from.direction_at(0, 0) : from.direction_at(sample.x, sample.y));
    return to.point(from.position_at(sample.x, sample.y, sample.surface.depth));
  };
  const PaperSample& now = paper_.now.samples[s];
  const PaperSample& before = paper_.before.samples[s];
  const bool as_published = !published_.surface_motion && same_samples_ && before.traced;
  const PaperSample& sample = as_published ? before : now;
  if (!sample.traced) return {0, 0};
  const FilmPoint to = as_published ? projected(*there_, here_, sample) : projected(here_, *there_, sample);
  if (!to.in_front) return {0, 0};
  const double sign = as_published ? -1 : 1;
  return {float(sign * (to.x - sample.x) * scale_x_), float(sign * (to.y - sample.y) * scale_y_)};
}

// What the history has at a pixel is not what the sample shows.
bool PaperPreview::shows_other(const PaperSample& sample, float x, float y) const {
  const PreviewPixel& there = paper_.before.surfaces[index(std::clamp(int(x), region_.x0, region_.x1 - 1),
                                                           std::clamp(int(y), region_.y0, region_.y1 - 1))];
  if (!sample.surface.hit() || !there.hit()) return sample.surface.hit() != there.hit();
  const V3d position = here_.position_at(sample.x, sample.y, sample.surface.depth);
  const V3d seen = there_->homogeneous(position - there_->origin());
  // Samples are wider apart than pixels, and so may be the points of a slope.
  const double slack = seen.z * 0.02 + 4 * there_->footprint(std::max(seen.z, 0.0)) / scale_x_;
  return !same_surface(there, sample.surface, float(seen.z), float(slack));
}

void PaperPreview::remap(const PixelRect& window) {
  const int columns = map_.columns(), rows = map_.rows();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = index(x, y);
      Rgb color(0, 0, 0);
      std::size_t nearest = 0;
      if (in_disk(x, y)) {
        nearest = disk_index(x, y);
        color = paper_.now.samples[nearest].light;
      } else {
        const std::uint32_t place = paper_.places[i];
        // As published, a sample stands for the centre of its pixel of the buffer, wherever the jitter has put it.
        const float u = (float(place >> 16) + 0.5f) * float(columns) / 65536 - 0.5f;
        const float v = (float(place & 0xffffu) + 0.5f) * float(rows) / 65536 - 0.5f;
        const int u0 = int(std::floor(u)), v0 = int(std::floor(v));
        const float au = u - float(u0), av = v - float(v0);
        float weights = 0, most = -1;
        for (int k = 0; k < 4; ++k) {
          const int column = std::clamp(u0 + (k & 1), first_column_, columns - 1);
          const int row = (v0 + (k >> 1) + rows) % rows;
          const float weight = ((k & 1) ? au : 1 - au) * ((k >> 1) ? av : 1 - av);
          const PaperSample& sample = paper_.now.samples[sample_index(column, row)];
          if (!sample.traced) continue;
          color += sample.light * weight;
          weights += weight;
          if (weight > most) {
            most = weight;
            nearest = sample_index(column, row);
          }
        }
        if (weights > 0) color *= 1 / weights;
      }
      const PaperSample& sample = paper_.now.samples[nearest];
      const V2f motion = motion_of(nearest);
      paper_.colors[i] = paper_.now.shown[i] = color;
      paper_.motion[i] = motion;
      paper_.now.surfaces[i] = sample.surface;
      Rgb& before = paper_.looked_up[i];
      before = kNone;
      if (!has_history_ || !published_.antialiasing) continue;
      const float hx = float(x) + motion.x, hy = float(y) + motion.y;
      if (!(hx >= float(region_.x0) && hx <= float(region_.x1 - 1) && hy >= float(region_.y0) &&
            hy <= float(region_.y1 - 1)))
        continue;
      if (published_.reject_history && shows_other(sample, hx + 0.5f, hy + 0.5f)) continue;
      const int x0 = int(hx), y0 = int(hy);
      const int x1 = std::min(x0 + 1, region_.x1 - 1), y1 = std::min(y0 + 1, region_.y1 - 1);
      const float ax = hx - float(x0), ay = hy - float(y0);
      const std::vector<Rgb>& shown = paper_.before.shown;
      before = (shown[index(x0, y0)] * (1 - ax) + shown[index(x1, y0)] * ax) * (1 - ay) +
               (shown[index(x0, y1)] * (1 - ax) + shown[index(x1, y1)] * ax) * ay;
    }
  }
}

float PaperPreview::tone(const Rgb& color) const {
  const float bright = luminance(color);
  return bright > 0 ? bright / (bright + mean_) : 0;
}

// Eq. 2.5 with alpha of eq. 4.10.
void PaperPreview::antialias(const PixelRect& window) {
  const double rate = paper_.rate.value(), diagonal = std::hypot(width_, height_);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = index(x, y);
      const Rgb& before = paper_.looked_up[i];
      const double distance = from_gaze(x, y);
      if (distance < radius_ || std::isnan(before.x)) continue;
      float sum = 0;
      int count = 0;
      for (int j = std::max(y - 1, region_.y0); j <= std::min(y + 1, region_.y1 - 1); ++j) {
        for (int k = std::max(x - 1, region_.x0); k <= std::min(x + 1, region_.x1 - 1); ++k) {
          const Rgb& other = paper_.looked_up[index(k, j)];
          if (std::isnan(other.x)) continue;
          sum += tone(paper_.colors[index(k, j)]) - tone(other);
          ++count;
        }
      }
      const double difference = std::abs(sum) / std::max(count, 1);
      const V2f& motion = paper_.motion[i];
      const double moved = std::hypot(double(motion.x), double(motion.y)) / diagonal;
      const double alpha = retention(difference, motion_heuristic(moved, rate));
      const float share = 1 - float(1 - alpha) * beyond_disk(distance);
      paper_.now.shown[i] = before + (paper_.colors[i] - before) * share;
    }
  }
}

void PaperPreview::complete() {
  PaperHistory::Side& now = paper_.now;
  now.known = true;
  now.scene = target_.scene;
  now.camera = target_.camera;
  now.region = region_;
  now.film_region = target_.region;
  now.radius = radius_;
  now.width = width_;
  now.height = height_;
  now.gaze_x = map_.gaze_x();
  now.gaze_y = map_.gaze_y();
  now.disk = disk_;
  std::swap(paper_.now, paper_.before);
  ++paper_.picture;
  paper_.rate.add(now_s() - begun_s_, published_.mean_rate);
}

void PaperPreview::resolve(const PixelRect& window, std::vector<float> (&display)[3]) const {
  for (std::vector<float>& plane : display) plane.resize(std::size_t(window.area()));
  const std::vector<Rgb>& picture = target_.upscaling ? paper_.before.upscaled : paper_.before.shown;
  std::size_t to = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++to) {
      const Rgb& color = picture[std::size_t(y) * std::size_t(history_->width()) + std::size_t(x)];
      for (int c = 0; c < 3; ++c) display[c][to] = color[c];
    }
  }
}

}  // namespace helio
