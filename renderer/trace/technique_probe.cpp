#include "renderer/trace/technique_probe.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "renderer/film/resolve.h"
#include "renderer/film/splat_buffer.h"
#include "renderer/trace/scene_data.h"

namespace helio {

namespace {

constexpr int kLargestScale = 8;
constexpr double kEpsilon = 1e-2;
// Small pictures' seeds are not the large one's.
constexpr std::uint64_t kProbeSeed = 0x6a09e667f3bcc909u;
// Processor time of a ray with light paths over one without, shading included: measured 1.8 where the path tracer has
// its kernel for flat Lambert triangles, 1.1 to 1.8 elsewhere.
constexpr double kRayCost = 1.5;
// Share of the light paths' error that is the splats': fewer tiles with light paths make for fewer of them.
constexpr double kSplatShare = 0.5;
// A choice that gains less than this over doing the same everywhere is noise.
constexpr double kLeastGain = 0.05;

int probe_scale(int width, int height) {
  return std::clamp(std::min(width, height) / 24, 1, kLargestScale);
}

int small(int size, int scale) {
  return (size + scale - 1) / scale;
}

PathSettings probe_settings(PathSettings settings, Integrator integrator) {
  settings.integrator = integrator;
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

FilmState probe_state(bool splats) {
  FilmState state;
  state.splats = splats;
  return state;
}

}  // namespace

TechniqueProbe::TechniqueProbe(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, int width, int height,
                               const PathSettings& settings)
    : scene_(std::move(scene)),
      tiles_(width, height, false),
      scale_(probe_scale(width, height)),
      samples_(std::uint32_t(std::max(1, scale_ * scale_ / 8))),
      camera_(pose, small(width, scale_), small(height, scale_), scene_->origin()),
      settings_{probe_settings(settings, Integrator::path), probe_settings(settings, Integrator::bdpt)},
      films_{Film(small(width, scale_), small(height, scale_), probe_state(false)),
             Film(small(width, scale_), small(height, scale_), probe_state(true))} {
  if (scene_->impl().lights->empty()) return;  // nothing starts a light path
  constexpr int kPart = 2 * kPathGroupSize;
  const PixelRect picture = films_[0].bounds();
  for (int technique = kTechniques - 1; technique >= 0; --technique) {
    for (int half = 0; half < kHalves; ++half) {
      for (int y = 0; y < picture.y1; y += kPathGroupSize) {
        for (int x = 0; x < picture.x1; x += kPart) {
          jobs_.push_back({technique, half, intersect({x, y, x + kPart, y + kPathGroupSize}, picture)});
        }
      }
    }
  }
  stats_.resize(jobs_.size());
}

TechniqueProbe::~TechniqueProbe() = default;

void TechniqueProbe::run(int, std::size_t part) {
  const Job& job = jobs_[part];
  const CancelToken never;
  trace_window(*scene_, camera_, settings_[job.technique], {job.half, 0, samples_}, job.window, never,
               films_[job.technique], stats_[part]);
}

std::vector<TechniqueProbe::Estimate> TechniqueProbe::estimate(int technique) const {
  const int other = 1 - technique;
  double mean[3] = {0, 0, 0};
  const PixelRect picture = films_[0].bounds();
  for (int y = 0; y < picture.y1; ++y) {
    for (int x = 0; x < picture.x1; ++x) {
      for (int t = 0; t < kTechniques; ++t) {
        const Rgb value = resolve_mean(films_[t], x, y);
        for (int c = 0; c < 3; ++c) mean[c] += value[c] / (double(kTechniques) * double(picture.area()));
      }
    }
  }
  double rays = 0, paths = 0;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (jobs_[j].technique != technique) continue;
    rays += double(stats_[j].rays);
    paths += double(stats_[j].paths);
  }
  const double cost = rays / paths * (technique == 1 ? kRayCost : 1.0);

  std::vector<Estimate> estimates(tiles_.size());
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    // A tile and its neighbours: a tile has few pixels in the small picture.
    const PixelRect tile = tiles_.window(t);
    const PixelRect window = intersect({(tile.x0 - kLightTile) / scale_, (tile.y0 - kLightTile) / scale_,
                                        small(tile.x1 + kLightTile, scale_), small(tile.y1 + kLightTile, scale_)},
                                       picture);
    double noise = 0;
    for (int c = 0; c < 3; ++c) {
      double sum[kTechniques] = {0, 0}, squared[kTechniques] = {0, 0};
      for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
          for (int k = 0; k < kTechniques; ++k) {
            const Rgb a = half_mean(films_[k], 0, x, y), b = half_mean(films_[k], 1, x, y);
            const double difference = 0.5 * (double(a[c]) - double(b[c]));
            sum[k] += 0.5 * (double(a[c]) + double(b[c]));
            squared[k] += difference * difference;
          }
        }
      }
      const double n = double(window.area()), missing = (sum[other] - sum[technique]) / n;
      const double level = 0.5 * (sum[0] + sum[1]) / n;
      const double from_means = n * missing * missing - squared[other] / n;
      const double own = std::max(squared[technique] / n, technique == 0 ? from_means : 0.0);
      const double floor = level * level + kEpsilon * mean[c] * mean[c];
      if (floor > 0) noise += own / floor / 3;
    }
    estimates[t] = {std::isfinite(noise) ? noise : 0.0, cost};
  }
  return estimates;
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

void TechniqueProbe::finish_sweep(int) {
  if (jobs_.empty()) return;
  const std::vector<bool> on = choose(estimate(0), estimate(1));
  for (std::size_t t = 0; t < on.size(); ++t) tiles_.set(t, on[t]);
}

}  // namespace helio
