#include "renderer/film/display/cross_filter.h"

#include <algorithm>
#include <cstdlib>

#include "renderer/base/check.h"
#include "renderer/film/core/lanes.h"

namespace helio {
namespace {

// Squared differences are measured in this share of the variance: the square of k of Rousselle et al.
constexpr float kTolerance = 0.6f * 0.6f;
// Below these differences of the first hits weights hardly fall: 1 - cosine of normals, albedo, inverse depth of what a
// plane would have, which grows with the distance.
constexpr float kNormals = 10;                        // times 1 - cosine
constexpr float kAlbedo = 1 / (0.3f * 0.3f);          // times squared distance
constexpr float kDepth = 0.05f, kDepthGrowth = 0.1f;  // of the depth, and a pixel
// A tap whose variance is more than so many times the pixel's weighs less, as the inverse of its variance: half of a
// lamp's rim that one half missed would be spread over the wall beside it. Nearer to 1 this darkens, for noise is
// skewed.
constexpr float kCalmer = 64;
// Keeps zero over zero apart from a difference over none.
constexpr float kTiny = 1e-30f;

using Lanes = Float8;
constexpr std::size_t kWidth = sizeof(Lanes) / sizeof(float);
static_assert(kPlaneSlack >= 2 * kWidth, "compare() reads that far beyond a row");

Lanes lanes_at(const float* from) {
  Lanes v;
  load(from, v);
  return v;
}
Lanes positive(const Lanes& v) {
  return v > 0.0f ? v : Lanes{};
}
// About exp(-u), zero from 4 on.
Lanes falloff(const Lanes& u) {
  const Lanes t = positive(1 - 0.25f * u), square = t * t;
  return square * square;
}
void add_to(float* sum, const Lanes& value) {
  store(lanes_at(sum) + value, sum);
}

}  // namespace

// Fills apart_ for the tap that lies `tap` pixels of the input behind each.
void CrossFilter::compare(const HalvesWindow& in, const PixelRect& window, std::ptrdiff_t tap) {
  for (std::vector<float>& row : row_) row.resize(columns_ + kWidth);
  for (int y = -1; y <= window.height(); ++y) {
    const std::size_t from = in.at(window.x0 - 1, window.y0 + y);
    const float* const noise = in.variance.data() + from;
    for (std::size_t x = 0; x < columns_ + kWidth; x += kWidth) {
      const Lanes own = lanes_at(noise + x), other = lanes_at(noise + x + tap);
      const Lanes allowed = own + (own < other ? own : other);
      const Lanes unit = 1 / (9 * kTolerance * (own + other) + kTiny);
      for (int h = 0; h < kHalves; ++h) {
        Lanes square = -allowed;
        for (const std::vector<float>& channel : in.light[h]) {
          const float* const light = channel.data() + from + x;
          const Lanes apart = lanes_at(light) - lanes_at(light + tap);
          square += apart * apart;
        }
        store(square * unit, row_[h].data() + x);
      }
    }
    for (int h = 0; h < kHalves; ++h) {
      float* const out = apart_[h].data() + std::size_t(y + 1) * columns_;
      for (std::size_t x = 0; x < columns_; x += kWidth) {
        const float* const d = row_[h].data() + x;
        store(lanes_at(d) + lanes_at(d + 1) + lanes_at(d + 2), out + x);
      }
    }
  }
}

// Adds the tap (dx, dy) of all pixels.
void CrossFilter::add(const HalvesWindow& in, const PixelRect& window, int dx, int dy, int step) {
  const std::ptrdiff_t tap = std::ptrdiff_t(dy * step) * in.rect.width() + dx * step;
  const float along_x = float(dx * step), along_y = float(dy * step);
  const float depth_slack = kDepth * (1 + kDepthGrowth * float(step * std::max(std::abs(dx), std::abs(dy))));
  for (int y = 0; y < window.height(); ++y) {
    const std::size_t from = in.at(window.x0, window.y0 + y), to = std::size_t(y) * columns_;
    for (std::size_t x = 0; x < columns_; x += kWidth) {
      const auto here = [&](const std::vector<float>& plane) { return lanes_at(plane.data() + from + x); };
      const auto there = [&](const std::vector<float>& plane) { return lanes_at(plane.data() + from + x + tap); };
      const Lanes depth = here(in.inverse_depth);
      const Lanes expected = depth + here(in.slope_x) * along_x + here(in.slope_y) * along_y;
      const Lanes deep = (there(in.inverse_depth) - expected) / (depth * depth_slack + kTiny);
      Lanes hits = deep * deep, cosine{};
      for (int c = 0; c < 3; ++c) {
        cosine += here(in.normal[c]) * there(in.normal[c]);
        const Lanes apart = here(in.albedo[c]) - there(in.albedo[c]);
        hits += kAlbedo * (apart * apart);
      }
      hits += kNormals * (1 - cosine);
      const Lanes own_noise = here(in.variance), noise = there(in.variance);
      const Lanes calm = (kCalmer * own_noise + kTiny) / (own_noise + noise + kTiny);
      const Lanes counts = there(in.weight) * (calm < 1.0f ? calm : Lanes{} + 1.0f);
      for (int h = 0; h < kHalves; ++h) {
        const float* const apart = apart_[1 - h].data() + to + x;  // of the other half
        const Lanes differ = lanes_at(apart) + lanes_at(apart + columns_) + lanes_at(apart + 2 * columns_);
        const Lanes weight = counts * falloff(hits + positive(differ));
        for (int c = 0; c < 3; ++c) add_to(sums_[h][c].data() + to + x, weight * there(in.light[h][c]));
        add_to(weights_[h].data() + to + x, weight);
        add_to(noise_.data() + to + x, weight * weight * noise);
      }
    }
  }
}

void CrossFilter::finish(const HalvesWindow& in, const PixelRect& window, FilteredWindow& out) const {
  const auto area = std::size_t(window.area());
  for (auto& half : out.light) {
    for (std::vector<float>& plane : half) plane.resize(area);
  }
  out.variance.resize(area);
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      const std::size_t own = in.at(x, y), at = std::size_t(y - window.y0) * columns_ + std::size_t(x - window.x0);
      float squares = 0;
      for (int h = 0; h < kHalves; ++h) {
        const float weights = weights_[h][at];
        // A pixel keeps its own light if no tap counts.
        for (int c = 0; c < 3; ++c) out.light[h][c][i] = weights > 0 ? sums_[h][c][at] / weights : in.light[h][c][own];
        squares += weights * weights;
      }
      out.variance[i] = squares > 0 ? noise_[at] / squares : in.variance[own];
    }
  }
}

void CrossFilter::run(const HalvesWindow& in, const PixelRect& window, int step, FilteredWindow& out) {
  const int border = filter_border(step);
  HELIO_DCHECK(in.rect.x0 <= window.x0 - border && in.rect.y0 <= window.y0 - border &&
               in.rect.x1 >= window.x1 + border && in.rect.y1 >= window.y1 + border);
  columns_ = (std::size_t(window.width()) + kWidth - 1) / kWidth * kWidth;
  const std::size_t size = columns_ * std::size_t(window.height());
  for (int h = 0; h < kHalves; ++h) {
    apart_[h].resize(size + 2 * columns_);
    weights_[h].assign(size, 0.0f);
    for (std::vector<float>& plane : sums_[h]) plane.assign(size, 0.0f);
  }
  noise_.assign(size, 0.0f);
  const std::ptrdiff_t row = in.rect.width();
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      compare(in, window, std::ptrdiff_t(dy * step) * row + dx * step);
      add(in, window, dx, dy, step);
    }
  }
  finish(in, window, out);
}

}  // namespace helio
