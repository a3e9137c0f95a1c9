#include "renderer/trace/selection/pilot_render.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/film/estimate/resolve.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/paths/bidirectional_mis.h"
#include "renderer/trace/paths/path_kernel.h"
#include "renderer/trace/selection/tile_selection.h"

namespace helio {

namespace {

constexpr int kLargestScale = 8;
constexpr double kEpsilon = 1e-2;
// Small pictures' seeds are not the large one's.
constexpr std::uint64_t kProbeSeed = 0x6a09e667f3bcc909u;
// Processor time of a ray with light paths over one without, shading included: measured 1.8 where the path tracer has
// its kernel for flat Lambert triangles, 1.1 to 1.8 elsewhere.
constexpr double kRayCost = 1.3, kRayCostOverPlain = 1.8;
// Finds this many times as bright as the mean of the picture are too rare for differences of halves to tell of them.
constexpr double kRare = 30;
// Light this many times as bright as such finds is none that the path tracer sees at all: squares in their units end.
constexpr double kUnseen = 1e6;

int probe_scale(int width, int height) {
  return std::clamp(std::min(width, height) / 24, 1, kLargestScale);
}

int small(int size, int scale) {
  return (size + scale - 1) / scale;
}

// What a part of the large picture is in.
PixelRect small(const PixelRect& part, int scale) {
  return {part.x0 / scale, part.y0 / scale, small(part.x1, scale), small(part.y1, scale)};
}

PixelRect grown(const PixelRect& part) {
  return {part.x0 - kLightTile, part.y0 - kLightTile, part.x1 + kLightTile, part.y1 + kLightTile};
}

PathSettings probe_settings(PathSettings settings, Integrator integrator) {
  settings.integrator = integrator;
  settings.region = {};
  settings.seed ^= kProbeSeed + std::uint64_t(integrator);
  return settings;
}

// Of one half of a pixel, splats included.
Rgb half_mean(const Film& film, int half, int x, int y) {
  const HalfPixel& pixel = film.half(half, x, y);
  if (pixel.count == 0) return {0, 0, 0};
  Rgb mean = film.splats() ? film.splats()->mean(half, x, y) : Rgb(0, 0, 0);
  for (int c = 0; c < 3; ++c) mean[c] += float(pixel.sum[c] / pixel.count);
  return mean;
}

// Camera rays of a small pixel stay within one of the large picture's in its middle, so that what the small one differs
// in by itself is no noise.
PixelFilter pixel_of_large(int scale) {
  PixelFilter filter;
  if (scale == 1) return filter;
  filter.kind = PixelFilterKind::tent;
  filter.scale = 0.5 / scale;
  return filter;
}

PixelRect bounding(const PixelRect& a, const PixelRect& b) {
  if (a.empty()) return b;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

double mean_luminance(const Film& film, const PixelRect& window) {
  double sum = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) sum += luminance(resolve_mean(film, x, y));
  }
  return sum / double(window.area());
}

// What is known of a pixel of the small pictures.
struct PixelFinds {
  // Of one sample, by technique: as the halves differ, where no find counts for more than a rare one, and by what rare
  // ones are beyond that.
  double variances[2], rare[2];
  double confirmed2;  // as bright as both techniques have it, squared: what one of them alone has is noise
};

FilmState probe_state(bool splats) {
  FilmState state;
  state.splats = splats;
  return state;
}

}  // namespace

PilotRender::PilotRender(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, int width, int height,
                         const PathSettings& settings, std::shared_ptr<const CancelToken> cancel,
                         TechniqueHistory::Views known)
    : scene_(std::move(scene)),
      cancel_(std::move(cancel)),
      known_(std::move(known)),
      pose_(pose),
      tiles_(width, height, false),
      estimates_(tiles_.size()),
      measured_(tiles_.size(), false),
      region_(settings.region.empty() ? PixelRect{0, 0, width, height} : settings.region),
      scale_(probe_scale(width, height)),
      samples_{std::uint32_t(std::max(2, scale_ * scale_ / 8)), std::uint32_t(std::max(1, scale_ * scale_ / 16))},
      camera_(pose, small(width, scale_), small(height, scale_), scene_->origin(), pixel_of_large(scale_)),
      splat_camera_(pose, small(width, scale_), small(height, scale_), scene_->origin()),
      settings_{probe_settings(settings, Integrator::path), probe_settings(settings, Integrator::bdpt)} {}

PilotRender::Pictures::Pictures(int width, int height)
    : films{Film(width, height, probe_state(false)), Film(width, height, probe_state(true))}, squares(width, height) {}

PilotRender::~PilotRender() = default;

std::size_t PilotRender::parts() const {
  if (scene_->impl().lights->empty()) return 0;  // nothing starts a light path
  if (current_ == kRecall) return known_.empty() ? 0 : tiles_.size() / std::size_t(tiles_.columns());
  return current_ == kProbeMore && clear_ ? 0 : jobs_.size();
}

void PilotRender::run(int sweep, std::size_t part) {
  if (sweep == kRecall) {
    const std::size_t columns = std::size_t(tiles_.columns()), first = part * columns;
    const auto recalled = recall_tiles(*scene_, pose_, known_, first, columns);
    std::copy(recalled.begin(), recalled.end(), estimates_.begin() + std::ptrdiff_t(first));
    return;
  }
  const Job& job = jobs_[part];
  TraceStats& stats = stats_[sweep == kProbePaths ? 0 : 1][part];
  if (sweep == kProbePaths) {
    const SampleRange range{job.half, 0, samples_[0]};
    trace_window(*scene_, camera_, settings_[0], range, job.window, *cancel_, pictures_->films[0], stats);
  } else {
    const std::uint32_t first = first_light_samples();
    const SampleRange range =
        sweep == kProbeLightPaths ? SampleRange{job.half, 0, first} : SampleRange{job.half, first, samples_[1] - first};
    WindowTask task{scene_->impl(), camera_, settings_[1], range, job.window, *cancel_, pictures_->films[1], nullptr};
    task.squares = &pictures_->squares;
    task.rare = rare_;
    task.splat_camera = &splat_camera_;
    run_bidirectional_kernel(task, stats);
  }
}

void PilotRender::finish_sweep(int sweep) {
  current_ = sweep + 1;
  if (scene_->impl().lights->empty()) return;
  if (sweep == kRecall) {
    find_unknown();
  } else if (sweep == kProbePaths) {
    constexpr double kLargestFloat = std::numeric_limits<float>::max();
    if (!jobs_.empty()) rare_ = float(std::min(kRare * mean_luminance(pictures_->films[0], picture_), kLargestFloat));
  } else if (sweep == kProbeLightPaths) {
    taken_ = first_light_samples();
    choose();
    clear_ |= taken_ == samples_[1];
  } else if (!clear_) {
    taken_ = samples_[1];
    choose();
  }
}

// What no view knows, and what is to be probed for it: a rectangle around all of that and what borders on it.
void PilotRender::find_unknown() {
  const int columns = tiles_.columns(), rows = int(tiles_.size()) / columns;
  const std::vector<std::optional<TileEstimate>> recalled = estimates_;
  PixelRect unknown;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const PixelRect tile = intersect(tiles_.window(t), region_);
    if (recalled[t] || tile.empty()) continue;
    measured_[t] = true;
    const int column = int(t) % columns, row = int(t) / columns;
    TileEstimate sum;
    int neighbours = 0;
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows - 1); ++y) {
      for (int x = std::max(column - 1, 0); x <= std::min(column + 1, columns - 1); ++x) {
        const auto& neighbour = recalled[std::size_t(y * columns + x)];
        if (!neighbour) continue;
        sum.add(*neighbour);
        ++neighbours;
      }
    }
    if (neighbours > 0) {
      estimates_[t] = sum.over(neighbours);
    } else {
      unknown = bounding(unknown, tile);
    }
  }
  if (unknown.empty()) return measured_.assign(tiles_.size(), false);
  // A tile's estimate takes in its neighbours.
  unknown = intersect(grown(unknown), region_);
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    measured_[t] = measured_[t] && !intersect(tiles_.window(t), unknown).empty();
  picture_ = small(unknown, scale_);
  for (int half = 0; half < kHalves; ++half) {
    for (int y = picture_.y0 / kPathGroupSize * kPathGroupSize; y < picture_.y1; y += kPathGroupSize) {
      for (int x = picture_.x0 / kPathGroupSize * kPathGroupSize; x < picture_.x1; x += kPathGroupSize)
        jobs_.push_back({half, intersect({x, y, x + kPathGroupSize, y + kPathGroupSize}, picture_)});
    }
  }
  settings_[1].region = picture_;
  pictures_ = std::make_unique<Pictures>(small(tiles_.width(), scale_), small(tiles_.height(), scale_));
  for (std::vector<TraceStats>& stats : stats_) stats.resize(jobs_.size());
}

double PilotRender::mean_cost(int technique) const {
  double rays = 0, paths = 0;
  for (const TraceStats& stats : stats_[technique]) {
    rays += double(stats.rays);
    paths += double(stats.paths);
  }
  if (technique == 0) return rays / paths;
  return rays / paths * (has_plain_kernel(scene_->features()) ? kRayCostOverPlain : kRayCost);
}

// Errors of what the small pictures show of a tile; none: nothing, or no light.
std::optional<TileEstimate> PilotRender::estimate(std::size_t t, double floor) const {
  // A tile and its neighbours: a tile has few pixels in the small picture.
  const PixelRect window = intersect(small(grown(tiles_.window(t)), scale_), picture_);
  if (window.empty()) return std::nullopt;
  double level = 0;
  std::vector<PixelFinds> pixels;
  pixels.reserve(std::size_t(window.area()));
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      PixelFinds& pixel = pixels.emplace_back();
      double means[kTechniques];
      for (int k = 0; k < kTechniques; ++k) {
        const double a = luminance(half_mean(pictures_->films[k], 0, x, y)),
                     b = luminance(half_mean(pictures_->films[k], 1, x, y));
        const double count = k == 0 ? samples_[0] : taken_, off = std::min(std::abs(a - b), double(rare_) / count);
        pixel.variances[k] = 0.25 * off * off * kHalves * count;
        means[k] = 0.5 * (a + b);
      }
      const double confirmed = std::max(0.0, std::min(means[0], means[1]));
      pixel.confirmed2 = confirmed * confirmed;
      const Rgb first = pictures_->squares.mean(0, x, y), second = pictures_->squares.mean(1, x, y);
      for (int k = 0; k < kTechniques; ++k)
        pixel.rare[k] = 0.5 * (double(first[k]) + double(second[k])) * unit_of_squares(rare_);
      level += means[1];
    }
  }
  const double n = double(window.area());
  level /= n;
  const double scale = level * level + floor;
  if (!(scale > 0) || !std::isfinite(scale)) return std::nullopt;
  TileEstimate found;
  for (const PixelFinds& pixel : pixels) {
    const double own = std::max(scale, pixel.confirmed2 + floor) * n;
    found.path.error += (pixel.variances[0] + pixel.rare[0]) / own;
    found.bdpt.error += (pixel.variances[1] + pixel.rare[1]) / own;
  }
  // Of a mean of one sample. Sums over tiles are not to lose the errors of others beside it.
  constexpr double kMost = 1e12;
  found.path.error = std::min(found.path.error, kMost);
  found.bdpt.error = std::min(found.bdpt.error, kMost);
  // Mean squares are at least squared means.
  if (level > kUnseen * double(rare_))
    found.path.error = std::max(found.path.error, kTriesToNever * level * level / scale);
  return found;
}

void PilotRender::choose() {
  if (!jobs_.empty()) {
    ProbedView view{pose_, tiles_.width(), tiles_.height(), 0, {}};
    view.brightness = whole() ? mean_luminance(pictures_->films[1], picture_) : known_.back()->brightness;
    view.tiles.resize(tiles_.size());
    const double floor = kEpsilon * view.brightness * view.brightness;
    const double share = double(picture_.area()) / double(small(region_, scale_).area());
    const double cost[kTechniques] = {mean_cost(0), mean_cost(1)};
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      if (!measured_[t]) continue;
      view.tiles[t] = estimate(t, floor);
      if (!view.tiles[t]) continue;
      view.tiles[t]->path.cost = cost[0];
      view.tiles[t]->bdpt.cost = cost[1];
      view.tiles[t]->bdpt.error /= error_of_fewer_light_paths(share);
      estimates_[t] = view.tiles[t];
    }
    // Of a view without light nothing is known: light that comes later is to be looked for.
    if (view.brightness > 0) probed_ = std::make_shared<const ProbedView>(std::move(view));
  }
  std::vector<TileEstimate> known;
  std::vector<std::size_t> numbers;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!estimates_[t] || intersect(tiles_.window(t), region_).empty()) continue;
    known.push_back(*estimates_[t]);
    numbers.push_back(t);
  }
  const TileSelection choice = choose_tiles(known);
  for (std::size_t k = 0; k < choice.on.size(); ++k) tiles_.set(numbers[k], choice.on[k]);
  clear_ = choice.clear;
}

}  // namespace helio
