#include "renderer/preview/edge_avoiding_filter.h"

#include <algorithm>
#include <cmath>

#include "renderer/preview/sample_order.h"
#include "renderer/trace/camera/camera_projection.h"

namespace helio {
namespace {

// Of neighbours at -1, 0 and 1 steps: the B3 spline of Dammertz et al. cut to three taps.
constexpr float kKernel[3] = {0.25f, 0.5f, 0.25f};
// How far apart the depths of two pixels of one surface may be beside kDepthSlack, in pixels' sides for each pixel
// between them.
constexpr float kStepSlack = 3.0f;
// Samples that count at most: what has many is one neighbour among others.
constexpr float kMostWeight = 16;
constexpr float kFilledWeight = 0.125f;

std::uint8_t pack_weight(float samples) {
  return std::uint8_t(std::min(samples * 8 + 0.5f, 255.0f));
}
float unpack_weight(std::uint8_t packed) {
  return float(packed) * 0.125f;
}

// Before the first level. Light that filled a gap in an earlier preview is better than none.
float first_weight(const PreviewPixel& pixel) {
  if (pixel.samples > 0) return pixel.samples;
  return pixel.lit ? kFilledWeight : 0.0f;
}
// How far noise explains that two pixels differ, [0, 1], as if a sample's standard deviation were its mean.
float likeness(float a, float a_samples, float b, float b_samples) {
  const float bright = std::max(a, b), apart = a - b;
  if (!(bright > 0)) return 1;
  const float explained = 4 * bright * bright * (1 / a_samples + 1 / b_samples);
  return sqr(explained / (explained + apart * apart));
}

}  // namespace

EdgeAvoidingFilter::EdgeAvoidingFilter(const PreviewView& target, int limit, PreviewHistory& history)
    : history_(history),
      limit_(limit),
      region_(target.region),
      here_(target.camera, history.width(), history.height(), target.scene->origin()) {}

// Of a pixel before a level: light and the samples that it stands for.
struct EdgeAvoidingFilter::Value {
  Rgb light;
  float samples;
};

EdgeAvoidingFilter::Value EdgeAvoidingFilter::value(std::size_t i, int level) const {
  const PreviewPixel& pixel = history_.current.pixels[i];
  const FilteredPixel& filtered = history_.filtered[i];
  const bool settled = pixel.samples >= limit_, from_pixels = level % 2 == 0;
  const std::uint16_t* light = settled || from_pixels ? pixel.light : filtered.light;
  const float samples =
      settled || level == 0 ? first_weight(pixel) : unpack_weight(from_pixels ? filtered.next_weight : filtered.weight);
  return {Rgb(unpack_half(light[0]), unpack_half(light[1]), unpack_half(light[2])), std::min(samples, kMostWeight)};
}

// Where no neighbour is of the same surface: the mean of those that have light, else of the whole picture.
Rgb EdgeAvoidingFilter::around(int x, int y, int level) const {
  Rgb sum(0, 0, 0);
  float count = 0;
  const PixelRect near = intersect({x - 1, y - 1, x + 2, y + 2}, region_);
  for (int ty = near.y0; ty < near.y1; ++ty) {
    for (int tx = near.x0; tx < near.x1; ++tx) {
      const std::size_t t = history_.index(tx, ty);
      // What shines lights itself alone.
      if (history_.current.pixels[t].samples == kExactSamples) continue;
      const Value other = value(t, level);
      if (!(other.samples > 0)) continue;
      sum += other.light;
      ++count;
    }
  }
  return count > 0 ? sum * (1 / count) : history_.mean_light;
}

void EdgeAvoidingFilter::run(const PixelRect& window, int level) const {
  std::vector<PreviewPixel>& pixels = history_.current.pixels;
  const int step = 1 << level;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = history_.index(x, y);
      const PreviewPixel& here = pixels[i];
      if (here.samples >= limit_) continue;
      const float slack = here.depth * kDepthSlack + kStepSlack * float(step) * float(here_.footprint(here.depth));
      const Value own = value(i, level);
      const float bright = luminance(own.light);
      Rgb sum(0, 0, 0);
      float weights = 0;
      for (int j = -1; j <= 1; ++j) {
        const int ty = y + j * step;
        if (ty < region_.y0 || ty >= region_.y1) continue;
        for (int k = -1; k <= 1; ++k) {
          const int tx = x + k * step;
          if (tx < region_.x0 || tx >= region_.x1) continue;
          const std::size_t t = history_.index(tx, ty);
          const PreviewPixel& tap = pixels[t];
          if (!same_surface(tap, here, here.depth, slack)) continue;
          const Value other = value(t, level);
          if (!(other.samples > 0)) continue;
          const float w = kKernel[j + 1] * kKernel[k + 1] * other.samples;
          const float there = luminance(other.light);
          const float alike = own.samples > 0 ? likeness(bright, own.samples, there, other.samples) : 1;
          sum += other.light * (w * alike);
          weights += w * alike;
        }
      }
      FilteredPixel& out = history_.filtered[i];
      // In samples at the centre tap, whose kernel is a quarter.
      const std::uint8_t weight = pack_weight(4 * weights);
      const Rgb light = weights > 0 ? sum * (1 / weights) : around(x, y, level);
      if (level % 2 == 0) {
        for (int c = 0; c < 3; ++c) out.light[c] = pack_half(light[c]);
        out.weight = weight;
      } else {
        pixels[i].set_light(light);
        out.next_weight = weight;
      }
    }
  }
}

}  // namespace helio
