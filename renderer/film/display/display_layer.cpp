#include "renderer/film/display/display_layer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "renderer/base/check.h"
#include "renderer/base/half_float.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/display/cross_filter.h"
#include "renderer/film/display/halves_window.h"
#include "renderer/film/estimate/pixel_row.h"
#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

constexpr int kWindowWidth = 128, kWindowHeight = 64;
// Distance of a level's taps.
constexpr int kSteps[] = {1, 3};
constexpr int kLevels = int(std::size(kSteps));
// Errors are averaged over neighbourhoods of this radius, in pixels.
constexpr int kBlendRadius = 5;
constexpr float kBlendPixels = float((2 * kBlendRadius + 1) * (2 * kBlendRadius + 1));
// Sums of so much from a neighbourhood are floats still.
constexpr float kMostEvidence = 1e35f;
// Times the mean (F - m)^2 around a pixel, beyond which its own is a stray sample's.
constexpr float kStray = 4;
// Luminance, of the picture's mean, below which differences count as if they were as bright.
constexpr float kDarkest = 1e-3f;

PixelRect grown(const PixelRect& r, int by) {
  return {r.x0 - by, r.y0 - by, r.x1 + by, r.y1 + by};
}

// Terms of a window's blends, summed over channels: once as they are, and once over the square of what is shown there,
// so that bright pixels do not decide for dark neighbours.
struct Evidence {
  // V, (F_A - F_B)^2 / 4, product of residuals, its square, R.
  static constexpr int kTerms = 5;
  std::vector<float> terms[2][kTerms];
  std::vector<float> own_apart, own_residuals;  // of each pixel alone: (F - m)^2, and the product of its residuals
  std::vector<float> columns, means;  // sums of columns | of one term

  // Means over the neighbourhoods of the pixels of a rect, which has pixels outside `window` for nothing else.
  void average(const PixelRect& rect, const PixelRect& window);
};

void Evidence::average(const PixelRect& rect, const PixelRect& window) {
  const int left = window.x0 - rect.x0, width = window.width();
  means.resize(std::size_t(window.area()));
  // Columns, and zeroes beyond the rect; from the neighbourhood of the window's first pixel on.
  columns.assign(std::size_t(width + 2 * kBlendRadius), 0.0f);
  const int begin = kBlendRadius - left;
  for (auto& kind : terms) {
    for (std::vector<float>& term : kind) {
      for (int y = window.y0; y < window.y1; ++y) {
        const int top = std::max(y - kBlendRadius, rect.y0), bottom = std::min(y + kBlendRadius + 1, rect.y1);
        std::fill(columns.begin(), columns.end(), 0.0f);
        for (int ty = top; ty < bottom; ++ty) {
          const float* const row = term.data() + std::size_t(ty - rect.y0) * std::size_t(rect.width());
          for (int x = 0; x < rect.width(); ++x) columns[std::size_t(begin + x)] += row[x];
        }
        float* const out = means.data() + std::size_t(y - window.y0) * std::size_t(width);
        std::fill_n(out, width, 0.0f);
        for (int k = 0; k <= 2 * kBlendRadius; ++k) {
          for (int x = 0; x < width; ++x) out[x] += columns[std::size_t(k + x)];
        }
        for (int x = 0; x < width; ++x) {
          const int from = std::max(window.x0 + x - kBlendRadius, rect.x0);
          const int to = std::min(window.x0 + x + kBlendRadius + 1, rect.x1);
          out[x] *= 1 / float((to - from) * (bottom - top));
        }
      }
      std::copy(means.begin(), means.end(), term.begin());
    }
  }
}

// Of a neighbourhood of `pixels`, as the header has them.
struct Errors {
  float raw = 0, filtered = 0, apart = 0;  // V | M | R

  Errors(float v, float noise, float residuals, float residuals_squared, float r, float pixels)
      : raw(v), filtered(noise), apart(r) {
    // What is below its own standard error hardly counts: its noise above zero would add up to an error that is not
    // there.
    const float uncertain = std::sqrt(residuals_squared / (4 * pixels));
    if (residuals > 0) filtered += residuals / (1 + sqr(uncertain / residuals));
  }
  float best_share() const {
    return apart > 0 ? std::clamp((raw - filtered + apart) / (2 * apart), 0.0f, 1.0f) : 0.0f;
  }
  float of_blend(float share) const {
    const float covariance = 0.5f * (raw + filtered - apart), rest = 1 - share;
    return std::max(rest * rest * raw + share * share * filtered + 2 * share * rest * covariance, 0.0f);
  }
};

// Kept from window to window, for its memory.
struct Scratch {
  HalvesReader reader;
  HalvesWindow in;
  CrossFilter filter;
  FilteredWindow out;
  Evidence evidence;
};
Scratch& scratch() {
  thread_local Scratch kept;
  return kept;
}

}  // namespace

DisplayLayer::DisplayLayer(int width, int height) : width_(width), height_(height) {
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (std::vector<HalvesPixel>& of_level : filtered_) of_level.resize(pixels);
  blends_.resize(pixels);
}

void DisplayLayer::begin(const PixelRect& region) {
  known_ = false;
  region_ = region;
  windows_ = cut_aligned(region, kWindowWidth, kWindowHeight);
  brightness_.assign(windows_.size(), 0.0);
}

void DisplayLayer::run(const Film& film, int sweep, std::size_t part) {
  HELIO_DCHECK(film.width() == width_ && film.height() == height_);
  if (sweep == 0) return add_brightness(film, part);
  if (sweep <= kLevels) return filter(film, sweep - 1, windows_[part]);
  blend(film, windows_[part]);
}

void DisplayLayer::finish_sweep(int sweep) {
  if (sweep == 0) {
    double sum = 0;
    for (const double of_window : brightness_) sum += of_window;
    const double mean = sum / double(region_.area());
    // What floats hold of it: a scale of 1 is as good as any for a picture that is black.
    scale_ = mean > 0 && std::isfinite(mean) ? float(std::clamp(1 / mean, 1e-30, 1e30)) : 1.0f;
  }
  if (sweep + 1 == kSweeps) known_ = true;
}

void DisplayLayer::add_brightness(const Film& film, std::size_t part) {
  const PixelRect& window = windows_[part];
  thread_local PixelRow row;
  thread_local std::vector<float> means[3];
  double sum = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (std::vector<float>& channel : means) channel.clear();
    row.look(film, y, window.x0, window.x1);
    row.append_means(window.x0, window.x1, means);
    for (std::size_t i = 0; i < means[0].size(); ++i)
      sum += std::max(luminance(Rgb(means[0][i], means[1][i], means[2][i])), 0.0f);
  }
  brightness_[part] = sum;
}

void DisplayLayer::filter(const Film& film, int level, const PixelRect& window) {
  Scratch& s = scratch();
  s.reader.begin(film, region_, scale_);
  s.in.rect = grown(window, filter_border(kSteps[level]));
  s.reader.read_guides(s.in);
  if (level == 0) {
    s.reader.read_light(s.in);
    s.reader.read_variance(s.in);
  } else {
    for (auto& half : s.in.light) {
      for (std::vector<float>& plane : half) plane.resize(s.in.plane_size());
    }
    s.in.variance.resize(s.in.plane_size());
    const std::vector<HalvesPixel>& before = filtered_[level - 1];
    std::size_t i = 0;
    for (int y = s.in.rect.y0; y < s.in.rect.y1; ++y) {
      const int cy = std::clamp(y, region_.y0, region_.y1 - 1);
      for (int x = s.in.rect.x0; x < s.in.rect.x1; ++x, ++i) {
        const HalvesPixel& pixel = before[index(std::clamp(x, region_.x0, region_.x1 - 1), cy)];
        for (int h = 0; h < kHalves; ++h) {
          for (int c = 0; c < 3; ++c) s.in.light[h][c][i] = unpack_half(pixel.light[h][c]);
        }
        s.in.variance[i] = sqr(unpack_half(pixel.deviation));
      }
    }
  }
  s.filter.run(s.in, window, kSteps[level], s.out);
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      HalvesPixel& pixel = filtered_[level][index(x, y)];
      for (int h = 0; h < kHalves; ++h) {
        for (int c = 0; c < 3; ++c) pixel.light[h][c] = pack_half(s.out.light[h][c][i]);
      }
      pixel.deviation = pack_half(std::sqrt(s.out.variance[i]));
    }
  }
}

void DisplayLayer::blend(const Film& film, const PixelRect& window) {
  Scratch& s = scratch();
  s.reader.begin(film, region_, scale_);
  s.in.rect = intersect(grown(window, kBlendRadius), region_);
  s.reader.read_light(s.in);
  s.reader.read_variance(s.in);
  const PixelRect& rect = s.in.rect;
  for (auto& kind : s.evidence.terms) {
    for (std::vector<float>& term : kind) term.resize(std::size_t(rect.area()));
  }
  s.evidence.own_apart.resize(std::size_t(rect.area()));
  s.evidence.own_residuals.resize(std::size_t(rect.area()));
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      const HalvesPixel& pixel = filtered_[kLevels - 1][index(x, y)];
      const Rgb reflectance = filter_reflectance(film.features(x, y));
      float noise = 0, residuals = 0, apart = 0, bright = 0;
      for (int c = 0; c < 3; ++c) {
        const float a = unpack_half(pixel.light[0][c]), b = unpack_half(pixel.light[1][c]), r = reflectance[c];
        const float filtered = 0.5f * (a + b) * r;
        noise += sqr(0.5f * (a - b) * r);
        residuals += (a - s.in.light[0][c][i]) * (b - s.in.light[1][c][i]) * sqr(r);
        apart += sqr(filtered - s.in.mean[c][i]);
        bright += filtered;
      }
      s.evidence.own_apart[i] = apart;
      s.evidence.own_residuals[i] = residuals;
      const float relative = 1 / (sqr(bright / 3) + sqr(kDarkest));
      for (const int kind : {0, 1}) {
        const float scale = kind == 0 ? 1.0f : relative;
        const float terms[] = {s.in.mean_variance[i] * scale, noise * scale, residuals * scale, sqr(residuals * scale),
                               apart * scale};
        for (int k = 0; k < Evidence::kTerms; ++k) s.evidence.terms[kind][k][i] = std::min(terms[k], kMostEvidence);
      }
    }
  }
  s.evidence.average(rect, window);
  i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      const auto errors = [&](int kind) {
        const auto& terms = s.evidence.terms[kind];
        return Errors(terms[0][i], terms[1][i], terms[2][i], terms[3][i], terms[4][i], kBlendPixels);
      };
      // A pixel that is much farther from F than those around it is a stray sample, unless both halves say the same.
      const std::size_t own = s.in.at(x, y);
      const float usual = std::max(kStray * s.evidence.terms[0][4][i], s.evidence.own_residuals[own]);
      const float apart = s.evidence.own_apart[own];
      const float kept = apart > usual ? std::sqrt(usual / apart) : 1.0f;
      const float share = 1 - (1 - errors(1).best_share()) * kept;
      blends_[index(x, y)] = {pack_half(share), pack_half(std::sqrt(errors(0).of_blend(share) / 3))};
    }
  }
}

void DisplayLayer::resolve(const DisplayLayer* layer, const Film& film, ResolvedTile& tile) {
  const PixelRect& window = tile.window;
  for (int c = 0; c < 3; ++c) tile.display[c] = tile.radiance[c];
  tile.display_error.assign(std::size_t(window.area()), std::numeric_limits<float>::infinity());
  if (!layer || !layer->covers(window)) {
    for (std::size_t i = 0; i < tile.variance[0].size(); ++i)
      tile.display_error[i] = std::sqrt((tile.variance[0][i] + tile.variance[1][i] + tile.variance[2][i]) * (1.0f / 3));
    return;
  }
  const float unit = 1 / layer->scale_;
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      const HalvesPixel& pixel = layer->filtered_[kLevels - 1][layer->index(x, y)];
      const Blend& blend = layer->blends_[layer->index(x, y)];
      const Rgb reflectance = filter_reflectance(film.features(x, y));
      const float share = unpack_half(blend.share);
      for (int c = 0; c < 3 && share > 0; ++c) {
        const float light = 0.5f * (unpack_half(pixel.light[0][c]) + unpack_half(pixel.light[1][c]));
        float& shown = tile.display[c][i];
        shown += share * (light * reflectance[c] * unit - shown);
      }
      float square = sqr(unpack_half(blend.error) * unit);
      if (const FilmHistory* history = film.history())
        square += float(std::min(history->bias2(x, y, film.half(0, x, y).count, film.half(1, x, y).count), 1e30));
      tile.display_error[i] = std::sqrt(square);
    }
  }
}

}  // namespace helio
