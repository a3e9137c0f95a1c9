#include "renderer/preview/history_lookup.h"

#include <algorithm>
#include <cmath>

#include "renderer/film/core/lanes.h"
#include "renderer/preview/preview_taps.h"

namespace helio {
namespace {

// Pixels' sides by which a tap may be off beside, times the tangent of the surface's slope.
constexpr float kSlopeSlack = 2.0f;
constexpr float kSteepest = 30;
// Samples of light that only filled a gap.
constexpr float kFilledSamples = 0.25f;
// What such light counts for where it is carried on: it is no gap that wants to be filled anew.
constexpr float kCarriedFill = 4;
// Samples from which on the second source is not asked.
constexpr float kEnough = 16;
// By what factor the second must have more, for it has been looked up before and is blurred.
constexpr float kMoreByFar = 2;
// Added to a tap's weight along either axis, so that taps that miss the point by a whole pixel are better than none.
constexpr float kLeastWeight = 1e-4f;
// Pixels that are worked on at once.
constexpr int kAtOnce = 16;

}  // namespace

HistoryLookup::HistoryLookup(const PreviewView& target, PreviewHistory& history)
    : history_(history),
      here_(target.camera, history.width(), history.height(), target.scene->origin()),
      corner_(target.camera.forward),
      step_x_(0, 0, 0),
      step_y_(0, 0, 0) {
  if (!here_.orthographic()) {
    const V3d corner = here_.offset_at(0, 0, 1);
    corner_ = V3f(corner);
    step_x_ = V3f(here_.offset_at(1, 0, 1) - corner);
    step_y_ = V3f(here_.offset_at(0, 1, 1) - corner);
  }
  const bool last_is_true = history.last.known && history.last.scene.lock() == target.scene;
  for (const PreviewBuffer* buffer : {&history.rest, &history.last}) {
    if (!buffer->known) continue;
    // Light of a scene before an edit is a guess.
    const bool same = buffer->scene.lock() == target.scene;
    if (!same && last_is_true) continue;  // what it knew has been looked up, and corrected since
    const CameraProjection there(buffer->camera, history.width(), history.height(), target.scene->origin());
    sources_.push_back(
        {ViewMapping(here_, there), buffer->pixels.data(), buffer->region, same ? kExactSamples : std::uint8_t(1)});
  }
}

// All four taps at once, one in each lane.
HistoryLookup::Found HistoryLookup::look(const Source& source, const ViewMapping::Point& to, const PreviewPixel& pixel,
                                         float slope) const {
  Found found;
  if (!(to.depth > 0)) return found;
  const float fx = to.x - 0.5f, fy = to.y - 0.5f;
  const PixelRect& r = source.region;
  if (!(fx > float(r.x0) - 1 && fx < float(r.x1) && fy > float(r.y0) - 1 && fy < float(r.y1))) return found;
  const int x0 = int(std::floor(fx)), y0 = int(std::floor(fy));
  const float ax = fx - float(x0), ay = fy - float(y0);
  // A tap outside counts nothing, and in its place one at the edge is read.
  const float left = x0 >= r.x0 ? 1 - ax + kLeastWeight : 0, right = x0 + 1 < r.x1 ? ax + kLeastWeight : 0;
  const float above = y0 >= r.y0 ? 1 - ay + kLeastWeight : 0, below = y0 + 1 < r.y1 ? ay + kLeastWeight : 0;
  const int xa = std::max(x0, r.x0), xb = std::min(x0 + 1, r.x1 - 1);
  const PreviewPixel* const row_a = source.pixels + history_.index(0, std::max(y0, r.y0));
  const PreviewPixel* const row_b = source.pixels + history_.index(0, std::min(y0 + 1, r.y1 - 1));
  const PreviewTaps taps(row_a[xa], row_a[xb], row_b[xa], row_b[xb]);
  const float slack = to.depth * kDepthSlack + slope * float(here_.footprint(to.depth));

  Float4 weights = Float4{left, right, left, right} * Float4{above, above, below, below};
  weights = (Float4)((Int4)weights & taps.same_surface(pixel, to.depth, slack));
  const Float4 samples = taps.samples(), most = Float4{} + float(source.most_samples);
  const Float4 counted = samples < most ? samples : most;
  const Float4 shares = weights * (counted > kFilledSamples ? counted : Float4{} + kFilledSamples);
  const Float4 light = lane_sums({taps.light(0) * shares, taps.light(1) * shares, taps.light(2) * shares, shares});
  const Float4 counts = lane_sums({weights, weights * counted, Float4{}, Float4{}});
  if (!(counts[0] > 0)) return found;
  found.known = true;
  found.light = Rgb(light[0], light[1], light[2]) * (1 / light[3]);
  found.samples = counts[1] / counts[0];
  return found;
}

void HistoryLookup::run(const PixelRect& window) const {
  if (sources_.empty()) return;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; x += kAtOnce) {
      run_pixels(x, y, std::min(kAtOnce, window.x1 - x), &history_.current.pixels[history_.index(x, y)]);
    }
  }
}

// First what vectorises, for all pixels; then their lookups one by one.
void HistoryLookup::run_pixels(int x, int y, int count, PreviewPixel* pixels) const {
  float depth[kAtOnce] = {}, nx[kAtOnce] = {}, ny[kAtOnce] = {}, nz[kAtOnce] = {};
  float slope[kAtOnce] = {}, to_x[kMostSources][kAtOnce] = {}, to_y[kMostSources][kAtOnce] = {};
  float to_depth[kMostSources][kAtOnce] = {};
  for (int i = 0; i < count; ++i) {
    depth[i] = pixels[i].samples == kExactSamples ? 1.0f : pixels[i].depth;
    nx[i] = pixels[i].normal[0];
    ny[i] = pixels[i].normal[1];
    nz[i] = pixels[i].normal[2];
  }
  const V3f row = corner_ + step_y_ * (float(y) + 0.5f);
  for (int i = 0; i < count; ++i) {
    const float px = float(x + i) + 0.5f;
    const float dx = row.x + step_x_.x * px, dy = row.y + step_x_.y * px, dz = row.z + step_x_.z * px;
    const float cosine = std::fabs(nx[i] * dx + ny[i] * dy + nz[i] * dz) * (1.0f / 127);
    const float square = dx * dx + dy * dy + dz * dz;
    // Tangent of the angle between view and normal.
    const float tangent = std::sqrt(std::max(square - cosine * cosine, 0.0f)) / std::max(cosine, 1e-6f);
    slope[i] = kSlopeSlack * std::min(tangent, kSteepest);
  }
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    const ViewMapping& mapping = sources_[k].mapping;
    mapping.map_row(float(x) + 0.5f, float(y) + 0.5f, count, depth, to_x[k], to_y[k], to_depth[k]);
  }
  for (int i = 0; i < count; ++i) {
    PreviewPixel& pixel = pixels[i];
    if (pixel.samples == kExactSamples) continue;
    Found best;
    for (std::size_t k = 0; k < sources_.size() && best.samples < kEnough; ++k) {
      const Found found = look(sources_[k], {to_x[k][i], to_y[k][i], to_depth[k][i]}, pixel, slope[i]);
      if (found.known && (!best.known || found.samples > kMoreByFar * best.samples)) best = found;
    }
    if (!best.known) continue;
    pixel.set_light(best.light);
    const float samples = best.samples < 0.5f ? kCarriedFill : best.samples;
    pixel.set_samples(samples + 0.5f);
  }
}

}  // namespace helio
