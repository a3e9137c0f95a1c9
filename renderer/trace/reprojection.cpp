#include "renderer/trace/reprojection.h"

#include <algorithm>
#include <cassert>
#include <cfloat>
#include <cmath>
#include <optional>

#include "renderer/film/film_history.h"
#include "renderer/film/packed_values.h"
#include "renderer/trace/camera_projection.h"
#include "renderer/trace/centre_hits.h"
#include "renderer/trace/scene_data.h"

namespace helio {
namespace {

// Of a lookup's four pixels: the share of the weight that must be usable.
constexpr double kLeastWeight = 0.1;
// How far off the plane of a pixel's centre hit a point may lie, in its pixels.
constexpr double kPlaneTolerance = 0.5;
// Albedos that differ by more than this factor are of different things.
constexpr float kMostAlbedoRatio = 4;

struct Tap {
  int x = 0, y = 0;
  double weight = 0;
  Rgb modulation;  // new albedo over old
};

// What a source says of a pixel.
struct Lookup {
  double count = 0;  // effective samples of each half after the bias has its say; 0: nothing
  double mean[kHalves][3] = {};
  double spread[kHalves][3] = {};  // variance of one sample
  double bias2 = 0;
  double age = 0;
};

// Squared error of resampling a step edge whose squared second differences sum to one, along one axis. `zoom`: size of
// an old pixel over that of a new one.
double resampling_error2(double between, double zoom) {
  const double off = between * (1 - between);
  const double shrink = zoom >= 1 ? 1 - 1 / zoom : (1 / zoom - 1) * std::sqrt(zoom);
  return 2.0 / 3 * off * off + shrink * shrink / 12 + (zoom > 1 ? 0.25 * shrink * off : 0);
}

// One source as seen from the new picture.
class SourceView {
 public:
  SourceView(const PictureSource& source, int width, int height, const V3d& scene_origin)
      : pixels_(*source.pixels), projection_(source.pose, width, height, scene_origin) {}

  // Of a pixel whose centre sees `here` at `position`, or nothing in that direction. footprint: side of a new pixel
  // there.
  Lookup look(const CentreHit& here, const V3d& position, double footprint, double view_change) const {
    Lookup result;
    const FilmPoint p = here.hit() ? projection_.point(position) : projection_.direction(position);
    if (!p.in_front) return result;
    const double u = p.x - 0.5, v = p.y - 0.5;
    if (!(u > -1 && v > -1 && u < pixels_.width() && v < pixels_.height())) return result;
    const double fx = u - std::floor(u), fy = v - std::floor(v);
    Tap taps[4];
    int count = 0;
    double total = 0;
    const int x0 = int(std::floor(u)), y0 = int(std::floor(v));
    find_taps(here, position, p, x0, y0, fx, fy, taps, count, total);
    if (total < kLeastWeight) return result;

    double inverse_count = 0, bias2 = 0, bend2[2] = {0, 0}, slope2 = 0, off_x = -u, off_y = -v;
    const Rgb albedo = demodulation(unpack_reflectance(here.albedo));
    const double albedo2 = (sqr(albedo.x) + sqr(albedo.y) + sqr(albedo.z)) / 3;
    for (int i = 0; i < count; ++i) {
      const Tap& tap = taps[i];
      const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
      const double w = tap.weight / total;
      inverse_count += w / double(pixel.count);
      off_x += w * tap.x;
      off_y += w * tap.y;
      for (int axis = 0; axis < 2; ++axis) bend2[axis] += w * double(unpack_short_float(pixel.bend2[axis]));
      slope2 += w * double(unpack_short_float(pixel.slope2));
      result.age += w * pixel.age;
      double scale2 = 0;
      for (int c = 0; c < 3; ++c) {
        const double m = tap.modulation[c];
        scale2 += m * m / 3;
        for (int h = 0; h < kHalves; ++h) {
          result.mean[h][c] += w * m * double(pixel.mean[h][c]);
          result.spread[h][c] += w * m * m * double(unpack_short_float(pixel.spread[h][c]));
        }
      }
      bias2 += w * scale2 * double(pixel.bias2);
    }
    const double zoom = p.footprint / std::max(footprint, DBL_MIN);
    bias2 += albedo2 * (bend2[0] * resampling_error2(fx, zoom) + bend2[1] * resampling_error2(fy, zoom));
    bias2 += albedo2 * slope2 * (off_x * off_x + off_y * off_y);
    double squared = 0, variance = 0;
    for (int c = 0; c < 3; ++c) {
      squared += std::max(0.0, result.mean[0][c] * result.mean[1][c]) / 3;
      variance += (result.spread[0][c] + result.spread[1][c]) / 6;
    }
    bias2 += view_change * view_change * squared;
    result.bias2 = bias2;
    if (!(bias2 < DBL_MAX) || !(squared < DBL_MAX)) return {};
    const double inverse = inverse_count + (bias2 > 0 ? (variance > 0 ? bias2 / variance : DBL_MAX) : 0);
    result.count = std::min(1 / inverse, double(CarriedPixel::kMostCount));
    return result;
  }

 private:
  // The pixels around a point inside a surface that show that surface, and nothing else.
  void find_taps(const CentreHit& here, const V3d& position, const FilmPoint& p, int x0, int y0, double fx, double fy,
                 Tap (&taps)[4], int& count, double& total) const {
    const Rgb albedo = demodulation(unpack_reflectance(here.albedo));
    for (int k = 0; k < 4; ++k) {
      Tap tap;
      if (!place(k, x0, y0, fx, fy, tap)) continue;
      const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
      const CentreHit& there = pixels_.centre(tap.x, tap.y);
      if (!(pixel.count > 0) || !same_surface(here, there)) continue;
      if (here.hit()) {
        const V3d met = projection_.position_at(tap.x + 0.5, tap.y + 0.5, there.depth);
        const V3d normal(unpack_direction(there.normal));
        if (!(std::abs(dot(position - met, normal)) <= kPlaneTolerance * p.footprint)) continue;
      }
      tap.modulation = Rgb(1, 1, 1);
      if (there.albedo != here.albedo) {
        tap.modulation = albedo / demodulation(unpack_reflectance(there.albedo));
        const float most = max_component(tap.modulation);
        const float least = std::min(tap.modulation.x, std::min(tap.modulation.y, tap.modulation.z));
        if (!(most <= kMostAlbedoRatio && least >= 1 / kMostAlbedoRatio)) continue;
      }
      total += tap.weight;
      taps[count++] = tap;
    }
  }

  // The k-th of the four; false: beyond the picture or without weight.
  bool place(int k, int x0, int y0, double fx, double fy, Tap& tap) const {
    tap.x = x0 + (k & 1);
    tap.y = y0 + (k >> 1);
    tap.weight = (k & 1 ? fx : 1 - fx) * (k & 2 ? fy : 1 - fy);
    return tap.weight > 0 && tap.x >= 0 && tap.y >= 0 && tap.x < pixels_.width() && tap.y < pixels_.height();
  }

  const HistorySource& pixels_;
  CameraProjection projection_;
};

// From where `source` looks at the scene, when `now` looks at it from elsewhere; rebased.
std::optional<V3f> other_viewpoint(const CameraPose& source, const CameraPose& now, const RenderScene& scene) {
  const bool far_away = source.projection == Projection::orthographic;
  if (source.projection == now.projection) {
    if (far_away ? source.forward == now.forward : source.position == now.position) return std::nullopt;
  }
  if (!far_away) return V3f(source.position - scene.origin());
  return V3f(source.forward) * (-1e4f * scene.impl().radius);
}

PixelRect block_at(int x, int y, const PixelRect& window) {
  const auto next = [](int t) { return (t / kPathGroupSize + 1) * kPathGroupSize; };
  return intersect({x, y, next(x), next(y)}, window);
}

template <class Visit>
void for_each_block(const PixelRect& window, const Visit& visit) {
  for (int y = window.y0; y < window.y1; y = block_at(window.x0, y, window).y1) {
    for (int x = window.x0; x < window.x1; x = block_at(x, y, window).x1) visit(block_at(x, y, window));
  }
}

void fill(const Lookup& lookup, std::uint32_t count, Film& film, int x, int y) {
  CarriedPixel& carried = film.history()->carried(x, y);
  carried = {};
  if (count == 0) return;
  carried.count = count;
  carried.bias2 = float(std::min(lookup.bias2, double(FLT_MAX)));
  carried.age = std::uint32_t(std::min(255.0, std::ceil(lookup.age) + 1));
  for (int h = 0; h < kHalves; ++h) {
    HalfPixel& half = film.half(h, x, y);
    half.count = count;
    for (int c = 0; c < 3; ++c) {
      carried.mean[h][c] = float(lookup.mean[h][c]);
      half.sum[c] = double(carried.mean[h][c]) * count;
      half.deviations[c] = float(std::min(lookup.spread[h][c] * (count - 1.0), 0x1p127));
    }
  }
}

}  // namespace

void ReprojectionStats::add(const ReprojectionStats& other) {
  rays += other.rays;
  carried += other.carried;
  samples += other.samples;
}

Reprojection::Reprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                           const CameraPose& pose, const PixelFilter& filter, std::vector<PictureSource> sources)
    : scene_(std::move(scene)),
      film_(film),
      region_(region),
      pose_(pose),
      camera_(pose, film.width(), film.height(), scene_->origin(), filter),
      sources_(std::move(sources)) {
  assert(sources_.size() <= 3 && film.history());
  for (const PictureSource& source : sources_) {
    const std::optional<V3f> viewpoint = other_viewpoint(source.pose, pose, *scene_);
    viewpoint_slot_.push_back(viewpoint ? int(viewpoints_.size()) : -1);
    if (viewpoint) viewpoints_.push_back(*viewpoint);
  }
}

void Reprojection::find_centres(const PixelRect& window, ReprojectionStats& stats) {
  film_.clear(window);
  CentreHits centres(*scene_, camera_, pose_.forward);
  FilmHistory& history = *film_.history();
  for_each_block(window, [&](const PixelRect& block) {
    centres.trace(block);
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x)
        history.centre(x, y) = centres.at(x, y, viewpoints_, history.carried(x, y).mean[0]);
    }
  });
  stats.rays += std::uint64_t(window.area());
}

void Reprojection::carry(const PixelRect& window, ReprojectionStats& stats) {
  if (sources_.empty()) return;
  const CameraProjection now(pose_, film_.width(), film_.height(), scene_->origin());
  std::vector<SourceView> views;
  for (std::size_t i = 0; i < sources_.size(); ++i)
    views.emplace_back(sources_[i], film_.width(), film_.height(), scene_->origin());
  const FilmHistory& history = *film_.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const CentreHit& here = history.centre(x, y);
      const V3d position =
          here.hit() ? now.position_at(x + 0.5, y + 0.5, here.depth) : now.direction_at(x + 0.5, y + 0.5);
      const double footprint = (here.hit() ? now.point(position) : now.direction(position)).footprint;
      Lookup best;
      const bool border = on_border(history, x, y, region_);  // it may show several surfaces
      for (std::size_t i = 0; !border && i < views.size(); ++i) {
        const int slot = viewpoint_slot_[i];
        const double change = slot < 0 ? 0.0 : double(history.carried(x, y).mean[0][slot]);
        const Lookup lookup = views[i].look(here, position, footprint, change);
        if (lookup.count > best.count) best = lookup;
      }
      const auto count = std::uint32_t(best.count + 0.5);
      fill(best, count, film_, x, y);
      if (count == 0) continue;
      ++stats.carried;
      stats.samples += kHalves * double(count);
    }
  }
}

}  // namespace helio
