#include "renderer/preview/history_lookup.h"

#include <algorithm>
#include <cmath>

#include "renderer/film/core/lanes.h"

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

HistoryLookup::Found HistoryLookup::look(const Source& source, const ViewMapping::Point& to, const PreviewPixel& pixel,
                                         float slope) const {
  Found found;
  if (!(to.depth > 0)) return found;
  const float fx = to.x - 0.5f, fy = to.y - 0.5f;
  const PixelRect& r = source.region;
  if (!(fx > float(r.x0) - 1 && fx < float(r.x1) && fy > float(r.y0) - 1 && fy < float(r.y1))) return found;
  const int x0 = int(std::floor(fx)), y0 = int(std::floor(fy));
  const float ax = fx - float(x0), ay = fy - float(y0);
  const float slack = to.depth * kDepthSlack + slope * float(here_.footprint(to.depth));
  Float4 sum = {0, 0, 0, 0};  // light, and what it counts
  float weights = 0;
  const PixelRect taps = intersect({x0, y0, x0 + 2, y0 + 2}, r);
  for (int ty = taps.y0; ty < taps.y1; ++ty) {
    const float across = ty == y0 ? 1 - ay : ay;
    for (int tx = taps.x0; tx < taps.x1; ++tx) {
      const PreviewPixel& tap = source.pixels[history_.index(tx, ty)];
      if (!same_surface(tap, pixel, to.depth, slack)) continue;
      const float weight = (tx == x0 ? 1 - ax : ax) * across + 1e-4f;
      const float samples = std::min<float>(tap.samples, source.most_samples);
      const UInt4 light = {tap.light[0], tap.light[1], tap.light[2], 0};
      Float4 value = (Float4)(light << 13) * 0x1p112f;  // as unpack_light()
      value[3] = 1;
      sum += value * (weight * std::max(samples, kFilledSamples));
      weights += weight;
      found.samples += weight * samples;
    }
  }
  if (!(weights > 0)) return found;
  found.known = true;
  found.light = Rgb(sum[0], sum[1], sum[2]) * (1 / sum[3]);
  found.samples /= weights;
  return found;
}

void HistoryLookup::run(const PixelRect& window) const {
  constexpr int kMost = 16;  // pixels at once
  if (sources_.empty()) return;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; x += kMost) {
      run_row(x, y, std::min(kMost, window.x1 - x));
    }
  }
}

// First what vectorises, for all pixels; then their lookups one by one.
void HistoryLookup::run_row(int x, int y, int count) const {
  constexpr int kMost = 16;
  PreviewPixel* const pixels = &history_.current.pixels[history_.index(x, y)];
  float depth[kMost] = {}, nx[kMost] = {}, ny[kMost] = {}, nz[kMost] = {};
  float slope[kMost] = {}, to_x[kMost] = {}, to_y[kMost] = {}, to_depth[kMost] = {};
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
  sources_.front().mapping.map_row(float(x) + 0.5f, float(y) + 0.5f, count, depth, to_x, to_y, to_depth);
  for (int i = 0; i < count; ++i) {
    PreviewPixel& pixel = pixels[i];
    if (pixel.samples == kExactSamples) continue;
    Found best = look(sources_.front(), {to_x[i], to_y[i], to_depth[i]}, pixel, slope[i]);
    for (std::size_t k = 1; k < sources_.size() && best.samples < kEnough; ++k) {
      const Source& source = sources_[k];
      const auto to = source.mapping.map(float(x + i) + 0.5f, float(y) + 0.5f, pixel.depth);
      const Found found = look(source, to, pixel, slope[i]);
      if (found.known && (!best.known || found.samples > kMoreByFar * best.samples)) best = found;
    }
    if (!best.known) continue;
    pixel.set_light(best.light);
    const float samples = best.samples < 0.5f ? kCarriedFill : best.samples;
    pixel.set_samples(samples + 0.5f);
  }
}

}  // namespace helio
