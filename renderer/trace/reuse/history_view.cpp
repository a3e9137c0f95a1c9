#include "renderer/trace/reuse/history_view.h"

#include <cfloat>
#include <cmath>

#include "renderer/film/core/packed_values.h"

namespace helio {
namespace {

// Of a pixel: what covers less of another one shows nothing of what that hides.
constexpr float kLeastPart = 1.0f / 256;
// Of a lookup: the directions of a pixel that weighs less are not worth their BSDFs.
constexpr float kLeastShare = 1.0f / 16;
// How far off the plane of a pixel's centre hit a point may lie, in its pixels.
constexpr double kPlaneTolerance = 0.5;
// Albedos that differ by more than this factor are of different things.
constexpr float kMostAlbedoRatio = 4;
// Depths that the same ray has met, in scenes that may differ in how a surface is stored.
constexpr float kSameDepth = 1e-4f;

}  // namespace

HistoryView::HistoryView(const HistorySource& pixels, const CameraPose& pose, const std::optional<V3f>& viewpoint,
                         const CameraPose& now, const PixelRect& region, const V3d& scene_origin)
    : pixels_(pixels),
      region_(intersect(region, {0, 0, pixels.width(), pixels.height()})),
      projection_(pose, pixels.width(), pixels.height(), scene_origin),
      same_camera_(pose == now),
      viewpoint_(viewpoint),
      normal_(0, projection_) {}

void HistoryView::see(const CentreHit& here, const V3d& position, double footprint, const PrimaryHits& centres,
                      std::uint32_t key, SourceSight& sight) {
  sight.taps = find_taps(here, position);
  sight.zoom = float(sight.taps.footprint / std::max(footprint, DBL_MIN));
  sight.glossy = centres.depends_on_view();
  sight.evidence.reset();
  if (sight.glossy && viewpoint_ && sight.usable()) {
    sight.evidence = evidence_of(sight.taps, centres, sight.directions);
  } else {
    sight.lookup = look(here, sight, {}, Rgb(0, 0, 0), key);
  }
}

HistorySample HistoryView::look(const CentreHit& here, const SourceSight& sight, const ViewReweighting& change,
                                const Rgb& light, std::uint32_t key) const {
  if (!sight.usable()) return {};
  const HistoryTaps& taps = sight.taps;
  const Rgb beyond_albedo = change.ratio / change.albedo;

  LookupSums sums;
  double off_x = -taps.u, off_y = -taps.v;
  for (int i = 0; i < taps.count; ++i) {
    const HistoryTap& tap = taps.tap[i];
    const float w = tap.weight / taps.total;
    off_x += double(w) * tap.x;
    off_y += double(w) * tap.y;
    sums.add(pixels_.pixel(tap.x, tap.y), w, tap.modulation * beyond_albedo);
  }
  const Rgb albedo = demodulation(unpack_reflectance(here.albedo));
  const float albedo2 = (sqr(albedo.x) + sqr(albedo.y) + sqr(albedo.z)) / 3;
  const float resampled = albedo2 * (sums.bend2(0) * resampling_error2(taps.fx, sight.zoom) +
                                     sums.bend2(1) * resampling_error2(taps.fy, sight.zoom) +
                                     sums.slope2() * float(off_x * off_x + off_y * off_y));
  HistorySample result = sums.weigh(resampled, change.error, change.arrival * light);
  if (sight.glossy && !sight.evidence && result.total() > 0) {
    const WeighedDirections directions = directions_of(taps, 0);
    const WeighedDirections* const all[] = {&directions};
    pick_directions(all, key, result.directions);
  }
  return result;
}

HistorySample HistoryView::keep(const FilmHistory& now, int x, int y, int reach) const {
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
  sums.add(pixel, 1, Rgb(1, 1, 1));
  HistorySample result = sums.weigh(0, 0, Rgb(0, 0, 0));
  result.directions = pixels_.directions(x, y);
  result.kept = &pixel;
  return result;
}

HistoryTaps HistoryView::find_taps(const CentreHit& here, const V3d& position) {
  HistoryTaps taps;
  const FilmPoint p = here.hit() ? projection_.point(position) : projection_.direction(position);
  if (!p.in_front) return taps;
  taps.u = p.x - 0.5;
  taps.v = p.y - 0.5;
  if (!(taps.u > -1 && taps.v > -1 && taps.u < pixels_.width() && taps.v < pixels_.height())) return taps;
  taps.footprint = p.footprint;
  const V3d from_camera = position - projection_.origin();
  const int x0 = int(taps.u + 1) - 1, y0 = int(taps.v + 1) - 1;  // rounded down
  taps.fx = float(taps.u - x0);
  taps.fy = float(taps.v - y0);
  for (int k = 0; k < 4; ++k) {
    const float weight = (k & 1 ? taps.fx : 1 - taps.fx) * (k & 2 ? taps.fy : 1 - taps.fy);
    if (!add_tap(here, from_camera, p.footprint, {x0 + (k & 1), y0 + (k >> 1), weight, {}}, taps)) {
      taps.total = 0;
      taps.count = 0;
      return taps;
    }
  }
  return taps;
}

bool HistoryView::add_tap(const CentreHit& here, const V3d& from_camera, double footprint, HistoryTap tap,
                          HistoryTaps& taps) {
  if (!(tap.weight > 0) || !region_.contains(tap.x, tap.y)) return true;
  const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
  const CentreHit& there = pixels_.centre(tap.x, tap.y);
  // Nobody knows how much of what is hidden there the new pixel shows.
  if (pixel.mixed()) return tap.weight < kLeastPart;
  if (there.border || !(pixel.known(0) || pixel.known(1)) || !same_surface(here, there)) return true;
  if (here.hit()) {
    if (there.normal != normal_.packed) normal_ = Normal(there.normal, projection_);
    const double met = normal_.heights.at(tap.x + 0.5, tap.y + 0.5, double(there.depth));
    if (!(std::abs(dot(from_camera, normal_.direction) - met) <= kPlaneTolerance * footprint)) return true;
  }
  tap.modulation = Rgb(1, 1, 1);
  if (there.albedo != here.albedo) {
    tap.modulation = demodulation(unpack_reflectance(here.albedo)) / demodulation(unpack_reflectance(there.albedo));
    const float most = max_component(tap.modulation);
    const float least = std::min(tap.modulation.x, std::min(tap.modulation.y, tap.modulation.z));
    if (!(most <= kMostAlbedoRatio && least >= 1 / kMostAlbedoRatio)) return true;
  }
  taps.total += tap.weight;
  taps.tap[taps.count++] = tap;
  return true;
}

ViewEvidence HistoryView::evidence_of(const HistoryTaps& taps, const PrimaryHits& centres,
                                      WeighedDirections& directions) const {
  float least = kLeastShare * taps.total;
  if (!centres.textured()) {
    for (int i = 0; i < taps.count; ++i) least = std::max(least, taps.tap[i].weight);
  }
  directions = directions_of(taps, least);
  return centres.evidence_from(*viewpoint_, directions);
}

WeighedDirections HistoryView::directions_of(const HistoryTaps& taps, float least) const {
  WeighedDirections directions;
  float share = 0;
  for (int i = 0; i < taps.count; ++i) share += taps.tap[i].weight >= least ? taps.tap[i].weight : 0;
  for (int i = 0; i < taps.count; ++i) {
    const HistoryTap& tap = taps.tap[i];
    if (tap.weight < least) continue;
    const SourcePixel& pixel = pixels_.pixel(tap.x, tap.y);
    for (int h = 0; h < kHalves; ++h) {
      const float brought = tap.weight / share * luminance(pixel.means.mean(h));
      if (pixel.known(h) && brought > 0 && brought <= FLT_MAX)
        directions.add(pixels_.directions(tap.x, tap.y), h, brought);
    }
  }
  return directions;
}

}  // namespace helio
