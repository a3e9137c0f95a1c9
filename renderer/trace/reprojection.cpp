#include "renderer/trace/reprojection.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cfloat>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/film/film_history.h"
#include "renderer/film/film_windows.h"
#include "renderer/film/lanes.h"
#include "renderer/film/packed_values.h"
#include "renderer/trace/camera_projection.h"
#include "renderer/trace/centre_hits.h"
#include "renderer/trace/sampler.h"
#include "renderer/trace/scene_data.h"

namespace helio {
namespace {

// Of a lookup's four pixels: the share of the weight that must be usable.
constexpr float kLeastWeight = 0.1f;
// Of a pixel: what covers less of another one shows nothing of what that hides.
constexpr float kLeastPart = 1.0f / 256;
// Of a lookup: the directions of a pixel that weighs less are not worth their BSDFs.
constexpr float kLeastShare = 1.0f / 16;
// How far off the plane of a pixel's centre hit a point may lie, in its pixels.
constexpr double kPlaneTolerance = 0.5;
// Albedos that differ by more than this factor are of different things.
constexpr float kMostAlbedoRatio = 4;

// Of pixels that are looked up together: how much quieter than their mean variance one is taken to be, at most.
constexpr float kQuietest = 0x1p-20f;

// Of light that is taken to have come into view: its standard error, over it.
constexpr float kArrivalDoubt = 0.5f;

// Depths that the same ray has met, in scenes that may differ in how a surface is stored.
constexpr float kSameDepth = 1e-4f;

constexpr int kMostReach = 8;

// Of a glance: the side of the squares of which one pixel is looked at, and of a region the pixels at least.
constexpr int kMostGlanceCell = 8;
constexpr int kLeastGlances = 64;

struct Tap {
  int x = 0, y = 0;
  float weight = 0;
  Rgb modulation;  // new albedo over old
};

// The pixels around a point inside a surface that show that surface, and nothing else.
struct Taps {
  Tap tap[4];
  int count = 0;
  float total = 0;       // weight, at most 1
  double u = 0, v = 0;   // where the point lies, in pixels from the centre of the first of the film
  float fx = 0, fy = 0;  // between the four around it, [0, 1)
  double footprint = 0;  // side of a pixel there
};

// What a source says of a pixel.
struct Lookup {
  float count[kHalves] = {0, 0};  // effective samples after the bias has its say; 0: nothing
  float mean[kHalves][3] = {};
  float spread[kHalves][3] = {};  // variance of one sample
  float bias2 = 0;
  float age = 0;
  const SourcePixel* kept = nullptr;  // it is this pixel as it was
  DirectionReservoir directions;

  float total() const { return count[0] + count[1]; }
};

// What a pixel finds in a source.
struct Sight {
  Taps taps;
  float zoom = 1;  // size of a pixel of the source over that of a new one
  bool glossy = false;
  // Of surfaces that look different from there: neighbours have a say, and `lookup` is not known yet.
  std::optional<ViewEvidence> evidence;
  Lookup lookup;

  bool usable() const { return taps.total >= kLeastWeight; }
  // Of neighbours that ask the same pixel of the source.
  float shared() const { return std::max(zoom * zoom, 1.0f); }
};

// By source, as many as were asked.
struct Sights {
  Sight of[Reprojection::kMostSources];
  std::size_t asked = 0;

  bool waits() const {
    return std::any_of(of, of + asked, [](const Sight& sight) { return sight.evidence.has_value(); });
  }
};

// Of a block of the film.
struct BlockSights {
  PixelRect block;
  Sights pixels[kPathGroupSize * kPathGroupSize];

  Sights& at(int x, int y) { return pixels[std::size_t(y - block.y0) * kPathGroupSize + std::size_t(x - block.x0)]; }
};

// Sums over the pixels of a lookup, each times its weight.
struct LookupSums {
  Float8 means = {};    // three of each half, then 1 / count of each half
  Float8 spreads = {};  // three of each half, then bend2
  Float4 rest = {};     // weight of each half, slope2, age
  float bias2 = 0;
  // Of each pixel with two samples or more: its weight and the channels' mean spread.
  struct Spread {
    float weight, value;
  };
  Spread known_spreads[kHalves][4];
  int known[kHalves] = {0, 0};

  float mean(int h, int c) const { return means[3 * h + c]; }
  float inverse_count(int h) const { return means[6 + h]; }
  float spread(int h, int c) const { return spreads[3 * h + c]; }
  float bend2(int axis) const { return spreads[6 + axis]; }
  float weight(int h) const { return rest[h]; }
  float slope2() const { return rest[2]; }
  float age() const { return rest[3]; }
};

static_assert(offsetof(SourcePixel, packed_spread) + 8 == offsetof(SourcePixel, packed_structure));

// Of both halves.
inline Float8 means_and_counts(const SourcePixel& pixel) {
  Float4 a, b;
  pixel.means.unpack(a, b);
  if (!pixel.known(0)) a = Float4{};
  if (!pixel.known(1)) b = Float4{};
  Float8 values = __builtin_shufflevector(a, b, 0, 1, 2, 4, 5, 6, 3, 7);
  values[6] = pixel.inverse_count(0);
  values[7] = pixel.inverse_count(1);
  return values;
}

// unpack_short_number() of both halves' spreads, then the second differences.
inline Float8 spreads_and_bends(const SourcePixel& pixel) {
  UInt4 packed;
  load(&pixel.packed_spread, packed);  // the structure, and what comes after it
  const UInt8 codes =
      __builtin_shufflevector(packed, packed, 0, 0, 0, 1, 1, 1, 2, 2) >> UInt8{0, 10, 20, 0, 10, 20, 0, 10} & 1023u;
  const UInt8 numbers = (codes + kShortNumberOffset) << 20;
  return (Float8)(codes == 0u ? UInt8{} : numbers);
}

inline void add(const SourcePixel& pixel, float w, const Rgb& m, LookupSums& sums) {
  const Float8 modulation = {m.x, m.y, m.z, m.x, m.y, m.z, 1, 1};
  sums.means += means_and_counts(pixel) * modulation * w;
  const Float8 spreads = spreads_and_bends(pixel) * (modulation * modulation);
  sums.spreads += spreads * w;
  for (int h = 0; h < kHalves; ++h) {
    if (!pixel.known(h) || !(pixel.inverse_count(h) < 1)) continue;
    const float spread = (spreads[3 * h] + spreads[3 * h + 1] + spreads[3 * h + 2]) / 3;
    sums.known_spreads[h][sums.known[h]++] = {w, spread};
  }
  sums.rest += Float4{pixel.known(0) ? 1.0f : 0.0f, pixel.known(1) ? 1.0f : 0.0f, pixel.slope2(), pixel.age()} * w;
  sums.bias2 += w * (sqr(m.x) + sqr(m.y) + sqr(m.z)) * (1.0f / 3) * pixel.bias2();
}

// Geometric mean of what pixels scatter, none taken for quieter than kQuietest of `mean`; `mean` if nothing is known.
float quiet_spread(const LookupSums& sums, int h, float mean) {
  float logs = 0, weight = 0;
  for (int i = 0; i < sums.known[h]; ++i) {
    const LookupSums::Spread& spread = sums.known_spreads[h][i];
    logs += spread.weight * std::log2(std::max(spread.value, kQuietest * mean));
    weight += spread.weight;
  }
  return weight > 0 ? std::exp2(logs / weight) : mean;
}

// Squared error of resampling a step edge whose squared second differences sum to one, along one axis. `zoom`: size of
// an old pixel over that of a new one.
float resampling_error2(float between, float zoom) {
  const float off = between * (1 - between);
  const float shrink = zoom >= 1 ? 1 - 1 / zoom : (1 / zoom - 1) * std::sqrt(zoom);
  return 2.0f / 3 * off * off + shrink * shrink / 12 + (zoom > 1 ? 0.25f * shrink * off : 0);
}

// One source as seen from the new picture. Not thread safe.
class SourceView {
 public:
  // Pixels outside the region are of pictures that are no longer true.
  SourceView(const PictureSource& source, const std::optional<V3f>& viewpoint, const CameraPose& now,
             const PixelRect& region, int width, int height, const V3d& scene_origin)
      : pixels_(*source.pixels),
        region_(intersect(region, {0, 0, width, height})),
        projection_(source.pose, width, height, scene_origin),
        same_camera_(source.pose == now),
        viewpoint_(viewpoint),
        normal_(0, projection_) {}

  // Pixels are those of the new picture, whatever they show.
  bool same_camera() const { return same_camera_; }

  // Whether surfaces are seen from elsewhere than there.
  bool moved() const { return viewpoint_.has_value(); }

  // Of a pixel whose centre sees `here` at `position`, or nothing in that direction. footprint: side of a new pixel
  // there. centres: has the pixel in hand.
  void see(const CentreHit& here, const V3d& position, double footprint, const CentreHits& centres, std::uint32_t key,
           Sight& sight) {
    sight.taps = find_taps(here, position);
    sight.zoom = float(sight.taps.footprint / std::max(footprint, DBL_MIN));
    sight.glossy = centres.depends_on_view();
    sight.evidence.reset();
    if (sight.glossy && viewpoint_ && sight.usable()) {
      sight.evidence = evidence_of(sight.taps, centres);
    } else {
      sight.lookup = look(here, sight, {}, Rgb(0, 0, 0), key);
    }
  }

  // light: the picture's mean radiance.
  Lookup look(const CentreHit& here, const Sight& sight, const ViewChange& change, const Rgb& light,
              std::uint32_t key) const {
    if (!sight.usable()) return {};
    const Taps& taps = sight.taps;
    const Rgb beyond_albedo = change.ratio / change.albedo;

    LookupSums sums;
    double off_x = -taps.u, off_y = -taps.v;
    for (int i = 0; i < taps.count; ++i) {
      const Tap& tap = taps.tap[i];
      const float w = tap.weight / taps.total;
      off_x += double(w) * tap.x;
      off_y += double(w) * tap.y;
      add(pixels_.pixel(tap.x, tap.y), w, tap.modulation * beyond_albedo, sums);
    }
    const Rgb albedo = demodulation(unpack_reflectance(here.albedo));
    const float albedo2 = (sqr(albedo.x) + sqr(albedo.y) + sqr(albedo.z)) / 3;
    const float resampled = albedo2 * (sums.bend2(0) * resampling_error2(taps.fx, sight.zoom) +
                                       sums.bend2(1) * resampling_error2(taps.fy, sight.zoom) +
                                       sums.slope2() * float(off_x * off_x + off_y * off_y));
    Lookup result = weigh(sums, resampled, change.error, change.arrival * light);
    if (sight.glossy && result.total() > 0) pick_directions(taps, key, result.directions);
    return result;
  }

  // Whether what the pixel showed was next to another surface.
  bool border(int x, int y) const { return pixels_.centre(x, y).border; }

  // What it knew of the pixel itself, if that and all around it, so far, show what they showed. Precondition:
  // same_camera().
  Lookup keep(const FilmHistory& now, int x, int y, int reach) const {
    const SourcePixel& pixel = pixels_.pixel(x, y);
    if (!region_.contains(x, y) || pixel.empty()) return {};
    const PixelRect around = intersect({x - reach, y - reach, x + reach + 1, y + reach + 1}, region_);
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const CentreHit &here = now.centre(px, py), &there = pixels_.centre(px, py);
        if (pixels_.pixel(px, py).empty() || !same_surface(here, there)) return {};
        if (here.hit() && !(std::fabs(here.depth - there.depth) <= kSameDepth * here.depth)) return {};
      }
    }
    LookupSums sums;
    add(pixel, 1, Rgb(1, 1, 1), sums);
    Lookup result = weigh(sums, 0, 0, Rgb(0, 0, 0));
    result.directions = pixels_.directions(x, y);
    result.kept = &pixel;
    return result;
  }

 private:
  // Of the pixel in hand, by where its light came from as the nearest pixel knows it: neighbours ask the others. Where
  // surfaces are textured every pixel asks for itself.
  ViewEvidence evidence_of(const Taps& taps, const CentreHits& centres) const {
    WeighedDirection directions[kMostWeighed];
    std::size_t count = 0;
    float least = kLeastShare * taps.total;
    if (!centres.textured()) {
      for (int i = 0; i < taps.count; ++i) least = std::max(least, taps.tap[i].weight);
    }
    for (int i = 0; i < taps.count; ++i) {
      const Tap& tap = taps.tap[i];
      if (tap.weight < least) continue;
      const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
      for (int h = 0; h < kHalves; ++h) {
        const float weight = tap.weight * luminance(pixel.means.mean(h));
        if (!pixel.known(h) || !(weight > 0) || !(weight <= FLT_MAX)) continue;
        for (const std::uint32_t packed : pixels_.directions(tap.x, tap.y).place[h])
          directions[count++] = {packed, weight};
      }
    }
    return centres.evidence_from(*viewpoint_, {directions, count});
  }

  // resampled: squared error of the lookup, over the sums'. view_change: relative to the mean. arrival: radiance that
  // may have come into view, a guess.
  static Lookup weigh(const LookupSums& sums, float resampled, float view_change, const Rgb& arrival) {
    Lookup result;
    float variance[kHalves] = {0, 0};
    for (int h = 0; h < kHalves; ++h) {
      if (sums.weight(h) < kLeastWeight) continue;
      const float scale = 1 / sums.weight(h);
      for (int c = 0; c < 3; ++c) {
        result.mean[h][c] = sums.mean(h, c) * scale + arrival[c];
        result.spread[h][c] = sums.spread(h, c) * scale;
        variance[h] += result.spread[h][c] / 3;
        if (!std::isfinite(result.mean[h][c])) return {};
      }
    }
    // Squared mean, of what the halves share and of each.
    const int a = sums.weight(0) >= kLeastWeight ? 0 : 1, b = sums.weight(1) >= kLeastWeight ? 1 : 0;
    float shared = 0, square[kHalves] = {0, 0};
    for (int c = 0; c < 3; ++c) {
      shared += std::max(0.0f, result.mean[a][c] * result.mean[b][c]) / 3;
      for (int h = 0; h < kHalves; ++h) square[h] += sqr(result.mean[h][c]) / 3;
    }
    const float before = std::sqrt(sums.bias2), change2 = view_change * view_change;
    const float fixed = resampled + sqr(kArrivalDoubt) * (sqr(arrival.x) + sqr(arrival.y) + sqr(arrival.z)) / 3;
    const auto bias2_of = [&](float squared) { return sqr(before + std::sqrt(fixed + change2 * squared)); };
    result.bias2 = bias2_of(shared);
    result.age = sums.age();
    if (!(result.bias2 <= FLT_MAX)) return {};
    for (int h = 0; h < kHalves; ++h) {
      if (sums.weight(h) < kLeastWeight) continue;
      // The weight of a half must not follow its own samples: a bright one would raise the variance, and so the weight
      // that it gets itself. Of a single sample nothing is known about its variance: taken as its square.
      const int other = a == b ? h : 1 - h;
      const float v = variance[other] > 0 ? variance[other] : square[other];
      const float bias2 = change2 > 0 ? bias2_of(square[other]) : result.bias2;
      float inverse = bias2 > 0 ? (v > 0 ? bias2 / v : FLT_MAX) : 0;
      // What lies between a quiet pixel and a far noisier one, as the mirror image of a lamp, may be either: what
      // looking up between the two may have brought is held against the geometric mean of their variances.
      if (resampled > 0 && variance[other] > 0)
        inverse += std::max(0.0f, resampled / quiet_spread(sums, other, v) - resampled / v);
      const float all = sums.inverse_count(h) / sums.weight(h) + inverse;
      result.count[h] = std::min(1 / all, float(CarriedPixel::kMostCount));
    }
    return result;
  }

  // The normal that was met last: neighbours share it.
  struct Normal {
    std::uint32_t packed;
    V3d direction;
    CameraProjection::Heights heights;

    Normal(std::uint32_t bits, const CameraProjection& projection)
        : packed(bits), direction(unpack_direction(bits)), heights(projection.heights_along(direction)) {}
  };

  Taps find_taps(const CentreHit& here, const V3d& position) {
    Taps taps;
    const FilmPoint p = here.hit() ? projection_.point(position) : projection_.direction(position);
    if (!p.in_front) return taps;
    taps.u = p.x - 0.5;
    taps.v = p.y - 0.5;
    if (!(taps.u > -1 && taps.v > -1 && taps.u < pixels_.width() && taps.v < pixels_.height())) return taps;
    const int x0 = int(taps.u + 1) - 1, y0 = int(taps.v + 1) - 1;  // rounded down
    taps.fx = float(taps.u - x0);
    taps.fy = float(taps.v - y0);
    taps.footprint = p.footprint;
    const V3d from_camera = position - projection_.origin();
    for (int k = 0; k < 4; ++k) {
      Tap tap;
      tap.x = x0 + (k & 1);
      tap.y = y0 + (k >> 1);
      tap.weight = (k & 1 ? taps.fx : 1 - taps.fx) * (k & 2 ? taps.fy : 1 - taps.fy);
      if (!(tap.weight > 0) || !region_.contains(tap.x, tap.y)) continue;
      const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
      const CentreHit& there = pixels_.centre(tap.x, tap.y);
      if (pixel.mixed()) {
        // Nobody knows how much of what is hidden there the new pixel shows.
        if (tap.weight < kLeastPart) continue;
        taps.total = 0;
        taps.count = 0;
        return taps;
      }
      if (there.border || !(pixel.known(0) || pixel.known(1)) || !same_surface(here, there)) continue;
      if (here.hit()) {
        if (there.normal != normal_.packed) normal_ = Normal(there.normal, projection_);
        const double met = normal_.heights.at(tap.x + 0.5, tap.y + 0.5, double(there.depth));
        if (!(std::abs(dot(from_camera, normal_.direction) - met) <= kPlaneTolerance * p.footprint)) continue;
      }
      tap.modulation = Rgb(1, 1, 1);
      if (there.albedo != here.albedo) {
        tap.modulation = demodulation(unpack_reflectance(here.albedo)) / demodulation(unpack_reflectance(there.albedo));
        const float most = max_component(tap.modulation);
        const float least = std::min(tap.modulation.x, std::min(tap.modulation.y, tap.modulation.z));
        if (!(most <= kMostAlbedoRatio && least >= 1 / kMostAlbedoRatio)) continue;
      }
      taps.total += tap.weight;
      taps.tap[taps.count++] = tap;
    }
    return taps;
  }

  // Each of one of the pixels, as likely as that weighs.
  void pick_directions(const Taps& taps, std::uint32_t key, DirectionReservoir& out) const {
    for (int h = 0; h < kHalves; ++h) {
      for (int k = 0; k < DirectionReservoir::kPlaces; ++k) {
        key = mix_bits(key + 0x9e3779b9u);
        float u = unit_float(key) * taps.total;
        int i = 0;
        while (i + 1 < taps.count && (u -= taps.tap[i].weight) >= 0) ++i;
        out.place[h][k] = pixels_.directions(taps.tap[i].x, taps.tap[i].y).place[h][k];
      }
    }
  }

  const HistorySource& pixels_;
  PixelRect region_;
  CameraProjection projection_;
  bool same_camera_;
  std::optional<V3f> viewpoint_;  // none: where the new picture's is
  Normal normal_;
};

// Of a picture's surfaces, by some of its pixels; what is brighter than nearly all of them counts as if it were not.
Rgb mean_radiance(const HistorySource& source, const PixelRect& region) {
  constexpr int kAcross = 64;
  constexpr double kUsual = 0.95;
  const PixelRect r = intersect(region, {0, 0, source.width(), source.height()});
  const int columns = std::min(kAcross, r.width()), rows = std::min(kAcross, r.height());
  std::vector<Rgb> found;
  std::vector<float> brightness;
  for (int j = 0; j < rows; ++j) {
    const int y = r.y0 + int(std::int64_t(j) * r.height() / rows);
    for (int i = 0; i < columns; ++i) {
      const int x = r.x0 + int(std::int64_t(i) * r.width() / columns);
      const SourcePixel& pixel = source.pixel(x, y);
      if (pixel.empty() || source.centre(x, y).shines) continue;
      const Rgb mean = pixel.means.mean(0) * 0.5f + pixel.means.mean(1) * 0.5f;
      if (!is_finite(mean)) continue;
      found.push_back(mean);
      brightness.push_back(luminance(mean));
    }
  }
  if (found.empty()) return {0, 0, 0};
  const auto usual = brightness.begin() + std::ptrdiff_t(kUsual * double(brightness.size()));
  std::nth_element(brightness.begin(), usual, brightness.end());
  V3d sum(0, 0, 0);
  for (const Rgb& mean : found)
    sum += V3d(mean) * std::min(1.0, double(*usual) / std::max(double(luminance(mean)), DBL_MIN));
  return Rgb(sum * (1.0 / double(found.size())));
}

// From where `source` looks at the scene, when `now` looks at it from elsewhere; rebased.
std::optional<V3f> other_viewpoint(const CameraPose& source, const CameraPose& now, const RenderScene& scene) {
  const bool far_away = source.projection == Projection::orthographic;
  if (source.projection == now.projection) {
    if (far_away ? source.forward == now.forward : source.position == now.position) return std::nullopt;
  }
  if (!far_away) return V3f(source.position - scene.origin());
  return V3f(source.forward) * (-1e4f * scene.impl().radius);
}

std::vector<SourceView> views_of(const std::vector<PictureSource>& sources, const CameraPose& now,
                                 const PixelRect& region, const Film& film, const RenderScene& scene) {
  std::vector<SourceView> views;
  for (const PictureSource& source : sources) {
    views.emplace_back(source, other_viewpoint(source.pose, now, scene), now, region, film.width(), film.height(),
                       scene.origin());
  }
  return views;
}

// Overwrites what the pixel holds. swap: the source's first half is of the lineage of the film's second.
void fill(const Lookup& lookup, bool swap, Film& film, int x, int y) {
  CarriedPixel& carried = film.history()->carried(x, y);
  DirectionReservoir& directions = film.history()->directions(x, y);
  carried = {};
  directions = {};
  const auto from = [swap](int h) { return swap ? 1 - h : h; };
  Rgb means[kHalves];
  for (int h = 0; h < kHalves; ++h) {
    const float* mean = lookup.mean[lookup.count[from(h)] > 0 ? from(h) : from(1 - h)];
    means[h] = Rgb(mean[0], mean[1], mean[2]);
  }
  carried.means = PackedMeans(means[0], means[1]);
  for (int h = 0; h < kHalves; ++h) {
    const auto count = std::min(std::uint32_t(lookup.count[from(h)] + 0.5f), CarriedPixel::kMostCount);
    HalfPixel& half = film.half(h, x, y);
    half = {};
    carried.count[h] = half.count = count;
    if (count == 0) continue;
    const Rgb mean = carried.means.mean(h);
    for (int c = 0; c < 3; ++c) {
      half.sum[c] = double(mean[c]) * count;
      half.deviations[c] = std::min(lookup.spread[from(h)][c] * (float(count) - 1), 0x1p127f);
    }
  }
  if (carried.count[0] + carried.count[1] == 0) return;
  carried.bias2 = lookup.bias2;
  carried.age = lookup.age + 1;
  if (!lookup.kept || lookup.kept->looked_up()) carried.note_looked_up();
  if (lookup.kept && lookup.kept->mixed()) carried.note_mixed();
  for (int h = 0; h < kHalves; ++h) {
    for (int k = 0; k < DirectionReservoir::kPlaces; ++k) directions.place[h][k] = lookup.directions.place[from(h)][k];
  }
}

}  // namespace

bool can_reproject(const CameraPose& pose, const PixelFilter& filter) {
  return pose.lens_radius == 0 && filter_reach(filter) <= kMostReach;
}

void ReprojectionStats::add(const ReprojectionStats& other) {
  rays += other.rays;
  carried += other.carried;
  samples += other.samples;
}

Reprojection::Reprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                           const CameraPose& pose, const PixelFilter& filter, std::vector<PictureSource> sources)
    : film_(film), centres_(std::move(scene), film, region, pose, filter), sources_(std::move(sources)) {
  assert(sources_.size() <= kMostSources && film_.history());
  const V3d& p = pose.position;
  const V3d& f = pose.forward;
  for (const double number : {p.x, p.y, p.z, f.x, f.y, f.z})
    key_ = combine_hash(key_, std::uint32_t(std::bit_cast<std::uint64_t>(number) >> 20));
}

void Reprojection::find_light() const {
  std::call_once(light_found_, [this] {
    if (centres_.scene().features().only_lambert) return;
    for (std::size_t i = 0; i < sources_.size(); ++i) light_[i] = mean_radiance(*sources_[i].pixels, centres_.region());
  });
}

// Looks sources up for one pixel after the other. Not thread safe.
class Reprojection::Seeker {
 public:
  explicit Seeker(const Reprojection& of)
      : of_(of),
        now_(pose(), of.film_.width(), of.film_.height(), of.centres_.scene().origin()),
        views_(views_of(of.sources_, pose(), of.centres_.region(), of.film_, of.centres_.scene())) {
    if (moved()) of.find_light();
  }

  struct Found {
    Lookup lookup;
    bool swap = false;
  };
  // Whether some source was seen from elsewhere: glossy surfaces wait for their neighbours then.
  bool moved() const {
    return std::any_of(views_.begin(), views_.end(),
                       [](const SourceView& view) { return !view.same_camera() && view.moved(); });
  }

  // centres: has the pixel in hand, which met `here`. Sources are asked until one knows enough; of glossy surfaces, as
  // far as the pixel's own directions tell.
  void see(const CentreHit& here, int x, int y, const CentreHits& centres, Sights& sights) {
    const V3d position =
        here.hit() ? now_.position_at(x + 0.5, y + 0.5, here.depth) : now_.direction_at(x + 0.5, y + 0.5);
    const double footprint = now_.footprint(here.hit() ? double(here.depth) : dot(position, pose().forward));
    sights.asked = 0;
    while (sights.asked < views_.size()) {
      const std::size_t i = sights.asked++;
      Sight& sight = sights.of[i];
      if (!views_[i].same_camera()) {
        views_[i].see(here, position, footprint, centres, key_of(x, y, i), sight);
      } else {
        sight.evidence.reset();
        sight.lookup = views_[i].border(x, y) ? Lookup{} : views_[i].keep(*of_.film_.history(), x, y, 0);
      }
      if (sights.asked == views_.size()) break;
      const Lookup known = sight.evidence ? look(here, x, y, sights, i, nullptr) : sight.lookup;
      if (known.total() >= of_.sources_[i].enough) break;
    }
  }

  // sights: the pixel's, as see() left them. block: holds those of its neighbours; null: has none.
  Found tell(const CentreHit& here, int x, int y, const Sights& sights, BlockSights* block) const {
    Found best;
    for (std::size_t i = 0; i < sights.asked; ++i) {
      const Sight& sight = sights.of[i];
      const Lookup lookup = sight.evidence ? look(here, x, y, sights, i, block) : sight.lookup;
      if (lookup.total() > best.lookup.total()) best = {lookup, of_.sources_[i].swap};
      if (lookup.total() >= of_.sources_[i].enough) break;
    }
    return best;
  }

 private:
  std::uint32_t key_of(int x, int y, std::size_t source) const {
    return combine_hash(pixel_key(x, y, 0, std::uint64_t(source)), of_.key_);
  }

  // By the pixel's own directions and those of the pixels around. Precondition: it has evidence of that source.
  Lookup look(const CentreHit& here, int x, int y, const Sights& sights, std::size_t source, BlockSights* block) const {
    const Sight& sight = sights.of[source];
    const ViewEvidence& own = *sight.evidence;
    const ViewEvidence* alike[9];
    std::size_t count = 0;
    const PixelRect around = block ? intersect({x - 1, y - 1, x + 2, y + 2}, block->block) : PixelRect{};
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const Sights& there = block->at(px, py);
        if ((px == x && py == y) || there.asked <= source || !there.of[source].evidence) continue;
        const ViewEvidence& evidence = *there.of[source].evidence;
        if (evidence.like(own) && same_surface(here, of_.film_.history()->centre(px, py))) alike[count++] = &evidence;
      }
    }
    alike[count++] = &own;
    const ViewChange change = pooled_change(own, {alike, count}, sight.shared());
    return views_[source].look(here, sight, change, of_.light_[source], key_of(x, y, source));
  }

  const CameraPose& pose() const { return of_.centres_.pose(); }

  const Reprojection& of_;
  CameraProjection now_;
  std::vector<SourceView> views_;
};

bool Reprojection::glance(const PixelRect& window, ReprojectionStats& stats) const {
  for (const PictureSource& source : sources_) {
    if (source.pose == centres_.pose()) return true;
  }
  // A strip of one pixel's width, as high as eight of these cells, is in one of them.
  int cell = kMostGlanceCell;
  while (cell > 1 && centres_.region().area() < std::int64_t(cell) * cell * kLeastGlances) cell /= 2;
  CentreHits centres(centres_.scene(), centres_.camera(), centres_.pose().forward);
  Seeker seeker(*this);
  for (const PixelRect& part : cut_aligned(window, cell, cell)) {
    const int row = part.y0 / cell, column = part.x0 / cell;
    const int x = std::min(part.x0 + (5 * row + 3) % cell, part.x1 - 1);
    const int y = std::min(part.y0 + (3 * column + 1) % cell, part.y1 - 1);
    centres.trace({x, y, x + 1, y + 1});
    ++stats.rays;
    const CentreHit here = centres.at(x, y);
    Sights sights;
    seeker.see(here, x, y, centres, sights);
    if (seeker.tell(here, x, y, sights, nullptr).lookup.total() > 0) return true;
  }
  return false;
}

void Reprojection::clear(const PixelRect& window) {
  film_.clear(window);
}

void Reprojection::carry(const PixelRect& window, ReprojectionStats& stats) {
  CentreHits centres(centres_.scene(), centres_.camera(), centres_.pose().forward);
  Seeker seeker(*this);
  const auto sights = std::make_unique<BlockSights>();
  std::vector<std::pair<int, int>> waiting;  // pixels whose neighbours have a say
  for (const PixelRect& block : cut_aligned(window, kPathGroupSize, kPathGroupSize)) {
    film_.clear(block);
    sights->block = block;
    centres.trace(block);
    waiting.clear();
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        const CentreHit& here = film_.history()->centre(x, y) = centres.at(x, y);
        film_.features(x, y) = centres.features();  // until the first fresh sample has its own
        Sights& seen = sights->at(x, y);
        seeker.see(here, x, y, centres, seen);
        if (seen.waits()) {
          waiting.push_back({x, y});
          continue;
        }
        const Seeker::Found found = seeker.tell(here, x, y, seen, nullptr);
        fill(found.lookup, found.swap, film_, x, y);
      }
    }
    for (const auto& [x, y] : waiting) {
      const Seeker::Found found = seeker.tell(film_.history()->centre(x, y), x, y, sights->at(x, y), sights.get());
      fill(found.lookup, found.swap, film_, x, y);
    }
  }
  stats.rays += std::uint64_t(window.area());
}

void Reprojection::find_borders(const PixelRect& window, ReprojectionStats& stats) {
  stats.rays += centres_.find_borders(window);
}

void Reprojection::settle(const PixelRect& window, ReprojectionStats& stats) {
  const PixelRect& region = centres_.region();
  const std::vector<SourceView> views = views_of(sources_, centres_.pose(), region, film_, centres_.scene());
  FilmHistory& history = *film_.history();
  centres_.settle(window);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const bool border = history.centre(x, y).border;
      CarriedPixel& carried = history.carried(x, y);
      if (border) fill({}, false, film_, x, y);
      for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].same_camera() || !(border || views[i].border(x, y))) continue;
        const PixelRect reached = centres_.reached_from(x, y);
        if (sources_[i].edited && intersect(reached, region).area() < reached.area()) continue;
        const Lookup lookup = views[i].keep(history, x, y, centres_.reach());
        if (lookup.total() > float(carried.count[0]) + float(carried.count[1]))
          fill(lookup, sources_[i].swap, film_, x, y);
        if (lookup.total() >= sources_[i].enough) break;
      }
      const std::uint32_t count = carried.count[0] + carried.count[1];
      if (count == 0) {
        film_.features(x, y) = {};  // there is nothing to show
        continue;
      }
      ++stats.carried;
      stats.samples += double(count);
    }
  }
}

}  // namespace helio
