#include "renderer/film/display/halves_window.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "renderer/film/estimate/variance_pool.h"
#include "renderer/film/history/splat_row.h"

namespace helio {
namespace {

// Of reflectance: darker surfaces would make noise that is not theirs, as of a coat, too large.
constexpr float kLeastReflectance = 0.05f, kBlack = 0.02f;
// Radiance and variance in the reader's units, in which the picture's mean is 1. Beyond it squares would overflow.
constexpr double kMostRadiance = 1e15;
constexpr float kMostVariance = 1e30f;
// Times the brightest around it, what a half's pixel is at most. By 1 the mean of four samples of Sponza was 14 %
// darker than the film's, by 2 it is 8 %; by more, blots come back.
constexpr float kMostLight = 2;
// Pixels around a window of which light is read.
constexpr int kLightBorder = 2;
// Times the mean of (A - B)^2 / 2 over 3x3 pixels, what pooled variance is at most. So much, for the mean of few is far
// below its expectation where noise is made of rare events.
constexpr float kMostOfApart = 16;
// Albedo of emitters and sky moves by so much, and they are no neighbours of what has a reflectance.
constexpr float kOtherClass = 10;
// What a pixel with samples in one half weighs beside others: something where there are no others.
constexpr float kOneHalf = 1e-3f;

bool is_black(const PixelFeatures& features) {
  const float* a = features.albedo;
  return !(std::max({a[0], a[1], a[2]}) > kBlack);
}

int clamped(int x, int low, int high) {
  return std::min(std::max(x, low), high - 1);
}

// Calls visit(index, x, y) for the pixels of `rect` in order, with those outside `roi` moved to its edge.
template <class Visit>
void for_each_pixel(const PixelRect& rect, const PixelRect& roi, const Visit& visit) {
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y) {
    const int cy = clamped(y, roi.y0, roi.y1);
    for (int x = rect.x0; x < rect.x1; ++x) visit(i++, clamped(x, roi.x0, roi.x1), cy);
  }
}

float larger(float a, float b) {
  return a > b ? a : b;
}
float max3(float a, float b, float c) {
  return larger(larger(a, b), c);
}
float smaller(float a, float b) {
  return std::fabs(a) < std::fabs(b) ? a : b;
}

}  // namespace

Rgb filter_reflectance(const PixelFeatures& features) {
  if (is_black(features)) return Rgb(1, 1, 1);
  const float* a = features.albedo;
  return {std::max(a[0], kLeastReflectance), std::max(a[1], kLeastReflectance), std::max(a[2], kLeastReflectance)};
}

// Radiance of both halves; a half without samples has the other's.
void HalvesReader::read_halves(const PixelRect& rect) {
  for (auto& half : halves_) {
    for (std::vector<float>& plane : half) plane.resize(std::size_t(rect.area()));
  }
  const PixelRect clip = clipped(rect);
  const bool splats = film_->splats() != nullptr;
  thread_local SplatRow splat_rows[kHalves];
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y) {
    const int cy = clamped(y, roi_.y0, roi_.y1);
    for (int h = 0; h < kHalves && splats; ++h) splat_rows[h].look(*film_, h, cy, clip.x0, clip.x1, false);
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      const int cx = clamped(x, roi_.x0, roi_.x1);
      for (int h = 0; h < kHalves; ++h) {
        const int of = film_->half(h, cx, cy).count > 0 ? h : 1 - h;
        const HalfPixel& half = film_->half(of, cx, cy);
        const double share = half.count > 0 ? 1.0 / half.count : 0;
        for (int c = 0; c < 3; ++c) {
          const double mean = half.sum[c] * share + (splats && half.count > 0 ? splat_rows[of].mean(cx, c) : 0.0);
          halves_[h][c][i] = float(std::clamp(mean * double(scale_), -kMostRadiance, kMostRadiance));
        }
      }
    }
  }
}

void HalvesReader::read_light(HalvesWindow& out) {
  const PixelRect& r = out.rect;
  const PixelRect wide = grown(r, kLightBorder);
  read_halves(wide);
  for (int c = 0; c < 3; ++c) {
    out.mean[c].resize(out.plane_size());
    for (auto& half : out.light) half[c].resize(out.plane_size());
  }
  for (std::vector<float>& plane : brightness_) plane.resize(std::size_t(wide.area()));
  for (std::vector<float>& scales : scales_) scales.resize(std::size_t(r.width()));
  const std::size_t row = std::size_t(wide.width());
  for (int y = r.y0; y < r.y1; ++y) {
    const std::size_t from = std::size_t(y - wide.y0) * row + kLightBorder, to = out.at(r.x0, y);
    for (int c = 0; c < 3; ++c) {
      for (std::size_t x = 0; x < std::size_t(r.width()); ++x)
        out.mean[c][to + x] = 0.5f * (halves_[0][c][from + x] + halves_[1][c][from + x]);
    }
  }
  for_each_pixel(wide, roi_, [&](std::size_t i, int x, int y) {
    const Rgb inverse = Rgb(1, 1, 1) / filter_reflectance(film_->features(x, y));
    for (int h = 0; h < kHalves; ++h) {
      // A half without samples has no brightness of its own that the other would be held against.
      const bool known = film_->half(h, x, y).count > 0;
      brightness_[h][i] = known ? luminance(Rgb(halves_[h][0][i], halves_[h][1][i], halves_[h][2][i])) : 0.0f;
      for (int c = 0; c < 3; ++c) halves_[h][c][i] *= inverse[c];
    }
  });
  for (int y = r.y0; y < r.y1; ++y) {
    const std::size_t from = std::size_t(y - wide.y0) * row + kLightBorder, to = out.at(r.x0, y);
    for (int h = 0; h < kHalves; ++h) {
      const float* const own = brightness_[h].data() + from;
      const float* const other = brightness_[1 - h].data() + from;
      for (std::size_t x = 0; x < std::size_t(r.width()); ++x) {
        const float* const a = own + x - row;
        const float* const b = other + x - row;
        const float above = max3(max3(a[-1], a[0], a[1]), max3(b[-1], b[0], b[1]), other[x]);
        const float* const d = own + x + row;
        const float* const e = other + x + row;
        const float below = max3(max3(d[-1], d[0], d[1]), max3(e[-1], e[0], e[1]), 0.0f);
        const float beside = max3(larger(own[x - 1], own[x + 1]), other[x - 1], other[x + 1]);
        const float most = max3(above, below, beside);
        scales_[h][x] = own[x] > kMostLight * most ? kMostLight * most / own[x] : 1.0f;
      }
    }
    for (int h = 0; h < kHalves; ++h) {
      const float* const own = brightness_[h].data() + from;
      for (int c = 0; c < 3; ++c) {
        for (std::size_t x = 0; x < std::size_t(r.width()); ++x)
          out.light[h][c][to + x] = halves_[h][c][from + x] * (own[x] == 0 ? scales_[1 - h][x] : scales_[h][x]);
      }
    }
  }
}

// Fills bounds_: of the four 3x3 that have a pixel for a corner the one whose halves are least apart. What is pooled
// over 7x7 would let a lamp's rim explain that its light differs from the wall's beside it. One whose halves are not
// apart at all says nothing: no path has found light there yet, or none that varies.
void HalvesReader::bound_variance(const PixelRect& rect) {
  const PixelRect wide = grown(rect, kLightBorder);
  apart_.resize(std::size_t(wide.area()));
  for_each_pixel(wide, roi_, [&](std::size_t i, int x, int y) {
    float square = 0;
    for (int c = 0; c < 3; ++c) square += sqr(halves_[0][c][i] - halves_[1][c][i]);
    apart_[i] = film_->half(0, x, y).count > 0 && film_->half(1, x, y).count > 0 ? 0.5f * square : kMostVariance;
  });
  const int row = wide.width(), box_row = row - 2;
  boxes_.resize(std::size_t(box_row) * std::size_t(wide.height() - 2));
  std::size_t i = 0;
  for (int y = 0; y + 2 < wide.height(); ++y) {
    const float *const a = apart_.data() + y * row, *const b = a + row, *const c = b + row;
    for (int x = 0; x < box_row; ++x, ++i) {
      const float sum = a[x] + a[x + 1] + a[x + 2] + b[x] + b[x + 1] + b[x + 2] + c[x] + c[x + 1] + c[x + 2];
      boxes_[i] = sum > 0 ? sum : kMostVariance;
    }
  }
  bounds_.resize(std::size_t(rect.area()));
  i = 0;
  for (int y = 0; y < rect.height(); ++y) {
    const float *const above = boxes_.data() + y * box_row, *const below = above + 2 * box_row;
    for (int x = 0; x < rect.width(); ++x, ++i)
      bounds_[i] = kMostOfApart / 9 * std::min(std::min(above[x], above[x + 2]), std::min(below[x], below[x + 2]));
  }
}

void HalvesReader::read_variance(HalvesWindow& out) {
  const PixelRect clip = clipped(out.rect);
  for (std::vector<float>& channel : pooled_) channel.clear();
  pool_variance(*film_, clip, roi_, [](const PixelRow&) {}, pooled_);
  out.variance.resize(out.plane_size());
  out.mean_variance.resize(out.plane_size());
  const double square = double(scale_) * scale_;
  bound_variance(out.rect);
  for_each_pixel(out.rect, roi_, [&](std::size_t i, int x, int y) {
    const std::size_t from = std::size_t(y - clip.y0) * std::size_t(clip.width()) + std::size_t(x - clip.x0);
    const Rgb reflectance = filter_reflectance(film_->features(x, y));
    float light = 0, mean = 0;
    for (int c = 0; c < 3; ++c) {
      const float variance = float(std::min(pooled_[c][from] * square, double(kMostVariance)));
      light += 2 * variance / sqr(reflectance[c]);
      mean += variance;
    }
    out.variance[i] = std::min(light, bounds_[i]);
    out.mean_variance[i] = mean;
  });
}

void HalvesReader::read_guides(HalvesWindow& out) const {
  for (std::vector<float>* plane : {&out.weight, &out.inverse_depth, &out.slope_x, &out.slope_y})
    plane->resize(out.plane_size());
  for (int c = 0; c < 3; ++c) {
    out.albedo[c].resize(out.plane_size());
    out.normal[c].resize(out.plane_size());
  }
  for_each_pixel(out.rect, roi_, [&](std::size_t i, int x, int y) {
    const PixelFeatures& f = film_->features(x, y);
    const int halves = (film_->half(0, x, y).count > 0) + (film_->half(1, x, y).count > 0);
    const float counts[] = {0, kOneHalf, 1};
    out.weight[i] = counts[halves] * sqr(luminance(filter_reflectance(f)));
    V3f normal(f.normal[0], f.normal[1], f.normal[2]);
    const float length = std::sqrt(dot(normal, normal));
    normal = length > 0 ? normal * (1 / length) : V3f(1, 0, 0);
    for (int c = 0; c < 3; ++c) {
      out.albedo[c][i] = is_black(f) ? -kOtherClass : f.albedo[c];
      out.normal[c][i] = normal[c];
    }
    out.inverse_depth[i] = f.depth > 0 && f.depth < FLT_MAX ? 1 / f.depth : 0.0f;
  });
  // The lesser of the changes to either side, which is the surface's own where a border is near.
  const PixelRect& r = out.rect;
  const PixelRect inside = clipped(r);
  const std::ptrdiff_t row = r.width();
  const auto slope = [&](std::ptrdiff_t i, std::ptrdiff_t step, bool before, bool after) {
    const float* const z = out.inverse_depth.data() + i;
    if (!(*z > 0)) return 0.0f;
    const float backward = before ? z[0] - z[-step] : 0.0f, forward = after ? z[step] - z[0] : 0.0f;
    return before && after ? smaller(backward, forward) : backward + forward;
  };
  std::ptrdiff_t i = 0;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x, ++i) {
      const bool in_x = x >= inside.x0 && x < inside.x1, in_y = y >= inside.y0 && y < inside.y1;
      out.slope_x[std::size_t(i)] = in_x ? slope(i, 1, x > inside.x0, x + 1 < inside.x1) : 0.0f;
      out.slope_y[std::size_t(i)] = in_y ? slope(i, row, y > inside.y0, y + 1 < inside.y1) : 0.0f;
      if (!in_x || !in_y) out.weight[std::size_t(i)] = 0;
    }
  }
}

}  // namespace helio
