#include "renderer/trace/reprojection.h"

#include <algorithm>
#include <cassert>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <optional>

#include "renderer/film/film_history.h"
#include "renderer/film/film_windows.h"
#include "renderer/film/packed_values.h"
#include "renderer/trace/camera_projection.h"
#include "renderer/trace/centre_hits.h"
#include "renderer/trace/scene_data.h"

namespace helio {
namespace {

// Of a lookup's four pixels: the share of the weight that must be usable.
constexpr float kLeastWeight = 0.1f;
// How far off the plane of a pixel's centre hit a point may lie, in its pixels.
constexpr double kPlaneTolerance = 0.5;
// Albedos that differ by more than this factor are of different things.
constexpr float kMostAlbedoRatio = 4;

using Float8 = float __attribute__((vector_size(32)));
using Short8 = std::uint16_t __attribute__((vector_size(16)));
using Int8 = std::uint32_t __attribute__((vector_size(32)));

// Depths that the same ray has met, in scenes that may differ in how a surface is stored.
constexpr float kSameDepth = 1e-4f;

// How far a filter reaches, in pixels from a pixel's centre to the centres of others, at least one.
constexpr int kMostReach = 8;
int reach(const PixelFilter& filter) {
  switch (filter.kind) {
    case PixelFilterKind::box:
      return 1;
    case PixelFilterKind::tent:
      return std::max(1, int(std::ceil(std::min(filter.scale, 100.0))));
    case PixelFilterKind::gaussian:
      return std::max(1, int(std::ceil(std::min(4 * filter.scale, 100.0))));
  }
  return 1;
}

struct Tap {
  int x = 0, y = 0;
  float weight = 0;
  Rgb modulation;  // new albedo over old
};

// What a source says of a pixel.
struct Lookup {
  float count[kHalves] = {0, 0};  // effective samples after the bias has its say; 0: nothing
  float mean[kHalves][3] = {};
  float spread[kHalves][3] = {};  // variance of one sample
  float bias2 = 0;
  float age = 0;

  float total() const { return count[0] + count[1]; }
};

// Sums over the pixels of a lookup, each times its weight.
struct LookupSums {
  float mean[kHalves][3] = {}, inverse_count[kHalves] = {0, 0};
  float spread[kHalves][3] = {}, bend2[2] = {0, 0};
  float weight[kHalves] = {0, 0};
  float slope2 = 0, bias2 = 0, age = 0;
};

static_assert(offsetof(SourcePixel, inverse_count) == 24 && offsetof(SourcePixel, spread) == 32 &&
              offsetof(SourcePixel, bend2) == 44);

void add(const SourcePixel& pixel, float w, const Rgb& m, LookupSums& sums) {
  const auto add8 = [](float* to, const Float8& terms) {
    Float8 sum;
    std::memcpy(&sum, to, sizeof(sum));
    sum += terms;
    std::memcpy(to, &sum, sizeof(sum));
  };
  const Float8 modulation = {m.x, m.y, m.z, m.x, m.y, m.z, 1, 1};
  Float8 means;
  std::memcpy(&means, &pixel.mean, sizeof(means));
  add8(sums.mean[0], means * modulation * w);
  Short8 packed;
  std::memcpy(&packed, &pixel.spread, sizeof(packed));
  const auto spreads = (Float8)(__builtin_convertvector(packed, Int8) << 16);
  add8(sums.spread[0], spreads * (modulation * modulation) * w);
  for (int h = 0; h < kHalves; ++h) sums.weight[h] += pixel.known(h) ? w : 0.0f;
  sums.slope2 += w * unpack_short_float(pixel.slope2);
  sums.age += w * unpack_short_float(pixel.age);
  sums.bias2 += w * (sqr(m.x) + sqr(m.y) + sqr(m.z)) * (1.0f / 3) * pixel.bias2;
}

// Squared error of resampling a step edge whose squared second differences sum to one, along one axis. `zoom`: size of
// an old pixel over that of a new one.
float resampling_error2(float between, float zoom) {
  const float off = between * (1 - between);
  const float shrink = zoom >= 1 ? 1 - 1 / zoom : (1 / zoom - 1) * std::sqrt(zoom);
  return 2.0f / 3 * off * off + shrink * shrink / 12 + (zoom > 1 ? 0.25f * shrink * off : 0);
}

// One source as seen from the new picture.
class SourceView {
 public:
  // Pixels outside the region are of pictures that are no longer true.
  SourceView(const PictureSource& source, const PixelRect& region, int width, int height, const V3d& scene_origin)
      : pixels_(*source.pixels), region_(region), projection_(source.pose, width, height, scene_origin) {}

  // Of a pixel on a border, when this is a picture of the same view: what the very pixel knew, if all that its filter
  // reaches shows what it showed.
  Lookup same_pixel(const FilmHistory& now, int x, int y, int reach) const {
    const PixelRect around = intersect({x - reach, y - reach, x + reach + 1, y + reach + 1}, region_);
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const CentreHit &here = now.centre(px, py), &there = pixels_.centre(px, py);
        if (pixels_.pixel(px, py).empty() || !same_surface(here, there)) return {};
        if (here.hit() && !(std::fabs(here.depth - there.depth) <= kSameDepth * here.depth)) return {};
      }
    }
    const SourcePixel& pixel = pixels_.pixel(x, y);
    Lookup result;
    float variance[kHalves] = {0, 0}, square[kHalves] = {0, 0};
    for (int h = 0; h < kHalves; ++h) {
      for (int c = 0; c < 3; ++c) {
        result.mean[h][c] = pixel.mean[h][c];
        result.spread[h][c] = unpack_short_float(pixel.spread[h][c]);
        variance[h] += result.spread[h][c] / 3;
        square[h] += sqr(result.mean[h][c]) / 3;
      }
    }
    result.bias2 = pixel.bias2;
    result.age = unpack_short_float(pixel.age);
    for (int h = 0; h < kHalves; ++h) {
      if (pixel.inverse_count[h] == 0) continue;
      const int other = pixel.inverse_count[1 - h] == 0 ? h : 1 - h;  // as in look()
      const float v = variance[other] > 0 ? variance[other] : square[other];
      const float inverse = pixel.bias2 > 0 ? (v > 0 ? pixel.bias2 / v : FLT_MAX) : 0;
      result.count[h] = std::min(1 / (std::fabs(pixel.inverse_count[h]) + inverse), float(CarriedPixel::kMostCount));
    }
    return result;
  }

  // Of a pixel whose centre sees `here` at `position`, or nothing in that direction. footprint: side of a new pixel
  // there.
  Lookup look(const CentreHit& here, const V3d& position, double footprint, float view_change) const {
    Lookup result;
    const FilmPoint p = here.hit() ? projection_.point(position) : projection_.direction(position);
    if (!p.in_front) return result;
    const double u = p.x - 0.5, v = p.y - 0.5;
    if (!(u > -1 && v > -1 && u < pixels_.width() && v < pixels_.height())) return result;
    const int x0 = int(u + 1) - 1, y0 = int(v + 1) - 1;  // rounded down
    const auto fx = float(u - x0), fy = float(v - y0);
    Tap taps[4];
    int count = 0;
    float total = 0;
    find_taps(here, position, p, x0, y0, fx, fy, taps, count, total);
    if (total < kLeastWeight) return result;

    LookupSums sums;
    double off_x = -u, off_y = -v;
    for (int i = 0; i < count; ++i) {
      const Tap& tap = taps[i];
      const float w = tap.weight / total;
      off_x += double(w) * tap.x;
      off_y += double(w) * tap.y;
      add(pixels_.pixel(tap.x, tap.y), w, tap.modulation, sums);
    }
    const Rgb albedo = demodulation(unpack_reflectance(here.albedo));
    const float albedo2 = (sqr(albedo.x) + sqr(albedo.y) + sqr(albedo.z)) / 3;
    const auto zoom = float(p.footprint / std::max(footprint, DBL_MIN));
    const float resampled =
        albedo2 * (sums.bend2[0] * resampling_error2(fx, zoom) + sums.bend2[1] * resampling_error2(fy, zoom) +
                   sums.slope2 * float(off_x * off_x + off_y * off_y));
    float variance[kHalves] = {0, 0};
    for (int h = 0; h < kHalves; ++h) {
      if (sums.weight[h] < kLeastWeight) continue;
      const float scale = 1 / sums.weight[h];
      for (int c = 0; c < 3; ++c) {
        result.mean[h][c] = sums.mean[h][c] * scale;
        result.spread[h][c] = sums.spread[h][c] * scale;
        variance[h] += result.spread[h][c] / 3;
        if (!std::isfinite(result.mean[h][c])) return {};
      }
    }
    // Squared mean, of what the halves share and of each.
    const int a = sums.weight[0] >= kLeastWeight ? 0 : 1, b = sums.weight[1] >= kLeastWeight ? 1 : 0;
    float shared = 0, square[kHalves] = {0, 0};
    for (int c = 0; c < 3; ++c) {
      shared += std::max(0.0f, result.mean[a][c] * result.mean[b][c]) / 3;
      for (int h = 0; h < kHalves; ++h) square[h] += sqr(result.mean[h][c]) / 3;
    }
    const auto bias2_of = [&](float squared) {
      return sqr(std::sqrt(sums.bias2) + std::sqrt(resampled + view_change * view_change * squared));
    };
    result.bias2 = bias2_of(shared);
    result.age = sums.age;
    if (!(result.bias2 <= FLT_MAX)) return {};
    for (int h = 0; h < kHalves; ++h) {
      if (sums.weight[h] < kLeastWeight) continue;
      // The weight of a half must not follow its own samples: a bright one would raise the variance, and so the weight
      // that it gets itself. Of a single sample nothing is known about its variance: taken as its square.
      const int other = a == b ? h : 1 - h;
      const float v = variance[other] > 0 ? variance[other] : square[other];
      const float bias2 = bias2_of(square[other]);
      const float inverse = bias2 > 0 ? (v > 0 ? bias2 / v : FLT_MAX) : 0;
      const float all = sums.inverse_count[h] / sums.weight[h] + inverse;
      result.count[h] = std::min(1 / all, float(CarriedPixel::kMostCount));
    }
    return result;
  }

 private:
  // The pixels around a point inside a surface that show that surface, and nothing else.
  void find_taps(const CentreHit& here, const V3d& position, const FilmPoint& p, int x0, int y0, float fx, float fy,
                 Tap (&taps)[4], int& count, float& total) const {
    const V3d from_camera = position - projection_.origin();
    for (int k = 0; k < 4; ++k) {
      Tap tap;
      tap.x = x0 + (k & 1);
      tap.y = y0 + (k >> 1);
      tap.weight = (k & 1 ? fx : 1 - fx) * (k & 2 ? fy : 1 - fy);
      if (!(tap.weight > 0) || tap.x < 0 || tap.y < 0 || tap.x >= pixels_.width() || tap.y >= pixels_.height())
        continue;
      const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
      const CentreHit& there = pixels_.centre(tap.x, tap.y);
      if (!(pixel.known(0) || pixel.known(1)) || !same_surface(here, there)) continue;
      if (here.hit()) {
        const V3d normal(unpack_direction(there.normal));
        const V3d met = projection_.offset_at(tap.x + 0.5, tap.y + 0.5, double(there.depth));
        if (!(std::abs(dot(from_camera - met, normal)) <= kPlaneTolerance * p.footprint)) continue;
      }
      tap.modulation = Rgb(1, 1, 1);
      if (there.albedo != here.albedo) {
        tap.modulation = demodulation(unpack_reflectance(here.albedo)) / demodulation(unpack_reflectance(there.albedo));
        const float most = max_component(tap.modulation);
        const float least = std::min(tap.modulation.x, std::min(tap.modulation.y, tap.modulation.z));
        if (!(most <= kMostAlbedoRatio && least >= 1 / kMostAlbedoRatio)) continue;
      }
      total += tap.weight;
      taps[count++] = tap;
    }
  }

  const HistorySource& pixels_;
  PixelRect region_;
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

// swap: the source's first half is of the lineage of the film's second.
std::uint32_t fill(const Lookup& lookup, bool swap, Film& film, int x, int y) {
  CarriedPixel& carried = film.history()->carried(x, y);
  carried = {};
  for (int h = 0; h < kHalves; ++h) {
    const int from = swap ? 1 - h : h;
    const auto count = std::uint32_t(lookup.count[from] + 0.5f);
    carried.count[h] = count;
    if (count == 0) continue;
    HalfPixel& half = film.half(h, x, y);
    half.count = count;
    for (int c = 0; c < 3; ++c) {
      carried.mean[h][c] = lookup.mean[from][c];
      half.sum[c] = double(carried.mean[h][c]) * count;
      half.deviations[c] = std::min(lookup.spread[from][c] * (float(count) - 1), 0x1p127f);
    }
  }
  const std::uint32_t total = carried.count[0] + carried.count[1];
  if (total == 0) return 0;
  carried.bias2 = lookup.bias2;
  carried.age = lookup.age + 1;
  return total;
}

}  // namespace

bool can_reproject(const CameraPose& pose, const PixelFilter& filter) {
  return pose.lens_radius == 0 && reach(filter) <= kMostReach;
}

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
      camera_(pose, film.width(), film.height(), scene_->origin()),  // centres are of pixels, not of filters
      border_(reach(filter)),
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
  for (const PixelRect& block : cut_aligned(window, kPathGroupSize, kPathGroupSize)) {
    centres.trace(block);
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x)
        history.centre(x, y) = centres.at(x, y, viewpoints_, history.carried(x, y).mean[0]);
    }
  }
  stats.rays += std::uint64_t(window.area());
}

void Reprojection::carry(const PixelRect& window, ReprojectionStats& stats) {
  const CameraProjection now(pose_, film_.width(), film_.height(), scene_->origin());
  std::vector<SourceView> views;
  for (std::size_t i = 0; i < sources_.size(); ++i)
    views.emplace_back(sources_[i], region_, film_.width(), film_.height(), scene_->origin());
  FilmHistory& history = *film_.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      CentreHit& here = history.centre(x, y);
      here.border = history.on_border(x, y, border_, region_);
      const V3d position =
          here.hit() ? now.position_at(x + 0.5, y + 0.5, here.depth) : now.direction_at(x + 0.5, y + 0.5);
      const double footprint = now.footprint(here.hit() ? double(here.depth) : dot(position, pose_.forward));
      Lookup best;
      bool swap = false;
      for (std::size_t i = 0; i < views.size(); ++i) {
        if (here.border && sources_[i].pose != pose_) continue;
        const int slot = viewpoint_slot_[i];
        const float change = slot < 0 ? 0.0f : history.carried(x, y).mean[0][slot];
        const Lookup lookup = here.border ? views[i].same_pixel(history, x, y, border_)
                                          : views[i].look(here, position, footprint, change);
        if (lookup.total() > best.total()) {
          best = lookup;
          swap = sources_[i].swap;
        }
        if (lookup.total() >= sources_[i].enough) break;
      }
      const std::uint32_t count = fill(best, swap, film_, x, y);
      if (count == 0) continue;
      ++stats.carried;
      stats.samples += double(count);
    }
  }
}

}  // namespace helio
