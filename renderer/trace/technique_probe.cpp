#include "renderer/trace/technique_probe.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "renderer/film/resolve.h"
#include "renderer/film/splat_buffer.h"
#include "renderer/trace/path_kernel.h"

namespace helio {

namespace {

constexpr int kLargestScale = 8;
constexpr double kEpsilon = 1e-2;
// Small pictures' seeds are not the large one's.
constexpr std::uint64_t kProbeSeed = 0x6a09e667f3bcc909u;
// Processor time of a ray with light paths over one without, shading included: measured 1.8 where the path tracer has
// its kernel for flat Lambert triangles, 1.1 to 1.8 elsewhere.
constexpr double kRayCost = 1.3, kRayCostOverPlain = 1.8;
// Share of the light paths' error that is the splats': fewer tiles with light paths make for fewer of them.
constexpr double kSplatShare = 0.5;
// What a choice between tiles must gain over doing the same everywhere, for it is made from few samples a tile.
constexpr double kLeastGain = 0.3;
// Finds this many times as bright as the mean of the picture are too rare for differences of halves to tell of them.
constexpr double kRare = 30;

int probe_scale(int width, int height) {
  return std::clamp(std::min(width, height) / 24, 1, kLargestScale);
}

int small(int size, int scale) {
  return (size + scale - 1) / scale;
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

double mean_luminance(const Film& film, const PixelRect& window) {
  double sum = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) sum += luminance(resolve_mean(film, x, y));
  }
  return sum / double(window.area());
}

FilmState probe_state(bool splats) {
  FilmState state;
  state.splats = splats;
  return state;
}

}  // namespace

TechniqueProbe::TechniqueProbe(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, int width, int height,
                               const PathSettings& settings, std::shared_ptr<const CancelToken> cancel)
    : scene_(std::move(scene)),
      cancel_(std::move(cancel)),
      tiles_(width, height, false),
      scale_(probe_scale(width, height)),
      samples_{std::uint32_t(std::max(2, scale_ * scale_ / 8)), std::uint32_t(std::max(1, scale_ * scale_ / 16))},
      camera_(pose, small(width, scale_), small(height, scale_), scene_->origin(), pixel_of_large(scale_)),
      splat_camera_(pose, small(width, scale_), small(height, scale_), scene_->origin()),
      settings_{probe_settings(settings, Integrator::path), probe_settings(settings, Integrator::bdpt)},
      films_{Film(small(width, scale_), small(height, scale_), probe_state(false)),
             Film(small(width, scale_), small(height, scale_), probe_state(true))},
      squares_(small(width, scale_), small(height, scale_)) {
  if (scene_->impl().lights->empty()) return;  // nothing starts a light path
  const PixelRect region = settings.region.empty() ? PixelRect{0, 0, width, height} : settings.region;
  picture_ = {region.x0 / scale_, region.y0 / scale_, small(region.x1, scale_), small(region.y1, scale_)};
  for (int technique = 0; technique < kTechniques; ++technique) {
    for (int half = 0; half < kHalves; ++half) {
      for (int y = picture_.y0 / kPathGroupSize * kPathGroupSize; y < picture_.y1; y += kPathGroupSize) {
        for (int x = picture_.x0 / kPathGroupSize * kPathGroupSize; x < picture_.x1; x += kPathGroupSize) {
          jobs_.push_back({technique, half, intersect({x, y, x + kPathGroupSize, y + kPathGroupSize}, picture_)});
        }
      }
    }
  }
  settings_[1].region = picture_;
  stats_.resize(jobs_.size());
}

TechniqueProbe::~TechniqueProbe() = default;

void TechniqueProbe::run(int sweep, std::size_t part) {
  const Job& job = jobs_[std::size_t(sweep) * parts() + part];
  TraceStats& stats = stats_[std::size_t(sweep) * parts() + part];
  const SampleRange range{job.half, 0, samples_[job.technique]};
  if (job.technique == 0) {
    trace_window(*scene_, camera_, settings_[0], range, job.window, *cancel_, films_[0], stats);
  } else {
    WindowTask task{scene_->impl(), camera_, settings_[1], range, job.window, *cancel_, films_[1], nullptr};
    task.squares = &squares_;
    task.rare = rare_;
    task.splat_camera = &splat_camera_;
    run_bidirectional_kernel(task, stats);
  }
}

double TechniqueProbe::mean_cost(int technique) const {
  double rays = 0, paths = 0;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (jobs_[j].technique != technique) continue;
    rays += double(stats_[j].rays);
    paths += double(stats_[j].paths);
  }
  if (technique == 0) return rays / paths;
  return rays / paths * (has_plain_kernel(scene_->features()) ? kRayCostOverPlain : kRayCost);
}

void TechniqueProbe::finish_sweep(int sweep) {
  if (jobs_.empty()) return;
  if (sweep == 0) {
    rare_ = float(kRare * mean_luminance(films_[0], picture_));
    return;
  }
  const double brightness = mean_luminance(films_[1], picture_), floor = kEpsilon * brightness * brightness;
  const Estimate costs[kTechniques] = {{0, mean_cost(0)}, {0, mean_cost(1)}};
  std::vector<Estimate> path, bdpt;
  std::vector<std::size_t> tiles;  // of the region
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const PixelRect tile = tiles_.window(t);
    // A tile and its neighbours: a tile has few pixels in the small picture.
    const PixelRect window = intersect({(tile.x0 - kLightTile) / scale_, (tile.y0 - kLightTile) / scale_,
                                        small(tile.x1 + kLightTile, scale_), small(tile.y1 + kLightTile, scale_)},
                                       picture_);
    if (window.empty()) continue;
    double level = 0, rare = 0, differences[kTechniques] = {0, 0};
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) {
        for (int k = 0; k < kTechniques; ++k) {
          const double a = luminance(half_mean(films_[k], 0, x, y)), b = luminance(half_mean(films_[k], 1, x, y));
          differences[k] += 0.25 * (a - b) * (a - b);
          if (k == 1) level += 0.5 * (a + b);
        }
        rare += 0.5 * (double(squares_.mean(0, x, y).x) + double(squares_.mean(1, x, y).x));
      }
    }
    tiles.push_back(t);
    path.push_back(costs[0]);
    bdpt.push_back(costs[1]);
    const double n = double(window.area());
    level /= n;
    const double scale = n * (level * level + floor);
    if (!(scale > 0) || !std::isfinite(scale)) continue;
    // Of a mean of one sample.
    path.back().error = (differences[0] * kHalves * samples_[0] + rare) / scale;
    bdpt.back().error = differences[1] * kHalves * samples_[1] / scale;
  }
  const std::vector<bool> on = choose(path, bdpt);
  for (std::size_t k = 0; k < on.size(); ++k) tiles_.set(tiles[k], on[k]);
}

std::vector<bool> TechniqueProbe::choose(const std::vector<Estimate>& path, const std::vector<Estimate>& bdpt) {
  const std::size_t count = path.size();
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto gain = [&](std::size_t t) {
    return (path[t].error - bdpt[t].error) / std::max(bdpt[t].cost - path[t].cost, 1e-9 * path[t].cost);
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return gain(a) > gain(b); });
  double rest = 0, cost = 0;
  for (const Estimate& e : path) {
    rest += e.error;
    cost += e.cost;
  }
  std::vector<double> product{rest * cost};
  double with = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t t = order[k];
    rest -= path[t].error;
    with += bdpt[t].error;
    cost += bdpt[t].cost - path[t].cost;
    const double fewer = 1 + kSplatShare * (double(count) / double(k + 1) - 1);
    product.push_back((std::max(rest, 0.0) + with * fewer) * cost);
  }
  std::size_t best = std::size_t(std::min_element(product.begin(), product.end()) - product.begin());
  const std::size_t alike = product.back() < product.front() ? count : 0;
  if (product[best] > (1 - kLeastGain) * product[alike]) best = alike;
  std::vector<bool> on(count, false);
  for (std::size_t k = 0; k < best; ++k) on[order[k]] = true;
  return on;
}

}  // namespace helio
