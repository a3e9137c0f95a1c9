#include "renderer/film/display/display_layer.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "renderer/base/check.h"
#include "renderer/base/half_float.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/display/blend_errors.h"
#include "renderer/film/display/cross_filter.h"
#include "renderer/film/display/halves_window.h"
#include "renderer/film/display/oidn_images.h"
#include "renderer/film/estimate/pixel_row.h"
#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

constexpr int kWindowWidth = 128, kWindowHeight = 64;
// Distance of a level's taps.
constexpr int kSteps[] = {1, 3};
// Times the mean (F - m)^2 around a pixel, beyond which its own is a stray sample's.
constexpr float kStray = 4;

// First hits differ by more than so much in albedo, or in their normals: two surfaces, or a texture.
constexpr float kOtherAlbedo = 0.03f, kOtherNormal = 0.05f;

bool differ(const PixelFeatures& a, const PixelFeatures& b) {
  for (int c = 0; c < 3; ++c) {
    if (std::fabs(a.albedo[c] - b.albedo[c]) > kOtherAlbedo || std::fabs(a.normal[c] - b.normal[c]) > kOtherNormal)
      return true;
  }
  return false;
}

// A pixel's error by channel, from the packed root of its variance over all; kMostHalf: not known.
float film_error(std::uint16_t deviation) {
  const float root = unpack_half(deviation);
  return root < kMostHalf ? root * std::sqrt(1.0f / 3) : kMostHalf;
}

// Kept from window to window, for its memory.
struct Scratch {
  HalvesReader reader;
  HalvesWindow in;
  CrossFilter filter;
  FilteredWindow out;
  BlendEvidence evidence;
  // A window's pixels and those of its neighbourhoods:
  std::vector<std::uint8_t> border;             // first hits differ from a neighbour's
  std::vector<float> own_apart, own_residuals;  // (F - m)^2 | product of the residuals
};
Scratch& scratch() {
  thread_local Scratch kept;
  return kept;
}

}  // namespace

static_assert(std::size(kSteps) == DisplayLayer::kLevels);

DisplayLayer::DisplayLayer(int width, int height) : width_(width), height_(height) {
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (std::vector<HalvesPixel>& of_level : filtered_) of_level.resize(pixels);
  blends_.resize(pixels);
}

DisplayLayer::DisplayLayer(int width, int height, std::shared_ptr<const OidnLibrary> oidn)
    : width_(width), height_(height), oidn_(std::make_unique<OidnImages>(std::move(oidn), width, height)) {}

DisplayLayer::~DisplayLayer() = default;
DisplayLayer::DisplayLayer(DisplayLayer&&) noexcept = default;

std::size_t DisplayLayer::bytes_by_oidn(std::size_t pixels) {
  return OidnImages::bytes(pixels);
}

std::size_t DisplayLayer::bytes() const {
  const std::size_t pixels = std::size_t(width_) * std::size_t(height_);
  return oidn_ ? bytes_by_oidn(pixels) : pixels * bytes_per_pixel();
}

void DisplayLayer::begin(const PixelRect& region) {
  if (region != region_) known_ = false;
  region_ = region;
  next_sweep_ = 0;
  if (oidn_) oidn_->begin(region);
  windows_ = cut_aligned(region, kWindowWidth, kWindowHeight);
  brightness_.assign(windows_.size(), 0.0);
}

void DisplayLayer::run(const Film& film, int sweep, std::size_t part, const CancelToken* cancel) {
  HELIO_DCHECK(film.width() == width_ && film.height() == height_);
  if (oidn_ && sweep == 0) return oidn_->copy(film, windows_[part]);
  if (oidn_) {
    known_ = false;  // until finish_sweep(): the picture before is overwritten
    const Status made = oidn_->denoise(cancel);
    denoised_ = made.ok();
    if (!made && made.error().code != ErrorCode::cancelled) failure_ = made.error().message;
    return;
  }
  if (sweep == 0) return add_brightness(film, part);
  if (sweep <= kLevels) return filter(film, sweep - 1, windows_[part]);
  blend(film, windows_[part]);
}

void DisplayLayer::finish_sweep(int sweep) {
  next_sweep_ = sweep + 1;
  if (oidn_) {
    if (next_sweep_ == kOidnSweeps) known_ = denoised_;
    return;
  }
  if (sweep == 0) {
    double sum = 0;
    for (const double of_window : brightness_) sum += of_window;
    const double mean = sum / double(region_.area());
    // The scale is in the range of floats; 1 is as good as any for a picture that is black. It is a power of two, so
    // that it hardly ever changes while a picture gets samples.
    const bool some = mean > 0 && std::isfinite(mean);
    const float scale = some ? float(std::exp2(std::round(std::log2(std::clamp(1 / mean, 1e-30, 1e30))))) : 1.0f;
    if (scale != scale_) known_ = false;
    scale_ = scale;
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
      if (level == 0) deviation_of_mean(x, y) = pack_half(std::sqrt(s.in.mean_variance[s.in.at(x, y)]));
      for (int h = 0; h < kHalves; ++h) {
        for (int c = 0; c < 3; ++c) pixel.light[h][c] = pack_half(s.out.light[h][c][i]);
      }
      if (level + 1 < kLevels) pixel.deviation = pack_half(std::sqrt(s.out.variance[i]));
    }
  }
}

bool DisplayLayer::saturated(const HalvesPixel& pixel) {
  const std::uint16_t most = pack_half(kMostHalf);
  for (const auto& light : pixel.light) {
    if (std::max({light[0], light[1], light[2]}) >= most) return true;
  }
  return false;
}

// Notes which pixels of `rect` have other first hits than those beside, above or below.
void DisplayLayer::find_borders(const Film& film, const PixelRect& rect, std::vector<std::uint8_t>& border) const {
  border.assign(std::size_t(rect.area()), 0);
  const PixelRect wide = intersect(grown(rect, 1), region_);
  const auto mark = [&](int x, int y) {
    if (x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1)
      border[std::size_t(y - rect.y0) * std::size_t(rect.width()) + std::size_t(x - rect.x0)] = 1;
  };
  for (int y = wide.y0; y < wide.y1; ++y) {
    for (int x = wide.x0; x < wide.x1; ++x) {
      const PixelFeatures& own = film.features(x, y);
      if (x + 1 < wide.x1 && differ(own, film.features(x + 1, y))) mark(x, y), mark(x + 1, y);
      if (y + 1 < wide.y1 && differ(own, film.features(x, y + 1))) mark(x, y), mark(x, y + 1);
    }
  }
}

void DisplayLayer::blend(const Film& film, const PixelRect& window) {
  Scratch& s = scratch();
  s.reader.begin(film, region_, scale_);
  s.in.rect = intersect(grown(window, BlendEvidence::kRadius), region_);
  s.reader.read_light(s.in);
  const PixelRect& rect = s.in.rect;
  const auto pixels = std::size_t(rect.area());
  s.own_apart.resize(pixels);
  s.own_residuals.resize(pixels);
  find_borders(film, rect, s.border);
  s.evidence.begin(window);
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      const HalvesPixel& pixel = filtered_[kLevels - 1][index(x, y)];
      const Rgb reflectance = filter_reflectance(film.features(x, y));
      BlendEvidence::Pixel p{sqr(unpack_half(deviation_of_mean(x, y))), 0, 0, 0, 0};
      for (int c = 0; c < 3; ++c) {
        const float a = unpack_half(pixel.light[0][c]), b = unpack_half(pixel.light[1][c]), r = reflectance[c];
        const float filtered = 0.5f * (a + b) * r;
        p.noise += sqr(0.5f * (a - b) * r);
        p.residuals += (a - s.in.light[0][c][i]) * (b - s.in.light[1][c][i]) * sqr(r);
        p.apart += sqr(filtered - s.in.mean[c][i]);
        p.brightness += filtered * (1.0f / 3);
      }
      s.own_apart[i] = p.apart;
      const bool both = film.half(0, x, y).count > 0 && film.half(1, x, y).count > 0;
      s.own_residuals[i] = both ? p.residuals : 0;
      if (both) s.evidence.add(x, y, s.border[i], p);
    }
  }
  s.evidence.average();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t own = s.in.at(x, y);
      const BlendErrors errors = s.evidence.errors(x, y, s.border[own]);
      // A pixel that is much farther from F than those around it is a stray sample, unless both halves say the same.
      const float usual = std::max(kStray * errors.apart, s.own_residuals[own]);
      const float apart = s.own_apart[own];
      const float kept = apart > usual ? std::sqrt(usual / apart) : 1.0f;
      float share = 1 - (1 - s.evidence.best_share(x, y, s.border[own])) * kept;
      const bool samples = film.half(0, x, y).count > 0 || film.half(1, x, y).count > 0;
      // Where one half alone has samples nothing tells how far off the filter is. It is shown, for a film of so few
      // samples is noise, and the error is the film's.
      if (!samples || !errors.known) share = 1;
      if (saturated(filtered_[kLevels - 1][index(x, y)])) share = 0;
      blends_[index(x, y)] = {pack_half(share), pack_half(errors.known ? std::sqrt(errors.of_share(share) / 3)
                                                                       : film_error(deviation_of_mean(x, y)))};
    }
  }
}

Rgb DisplayLayer::shown(const Film& film, int x, int y, const Rgb& radiance) const {
  if (oidn_) return oidn_->output(x, y);
  const float share = unpack_half(blends_[index(x, y)].share);
  if (!(share > 0)) return radiance;
  const HalvesPixel& pixel = filtered_[kLevels - 1][index(x, y)];
  const Rgb reflectance = filter_reflectance(film.features(x, y));
  Rgb shown = radiance;
  for (int c = 0; c < 3; ++c) {
    const float light = 0.5f * (unpack_half(pixel.light[0][c]) + unpack_half(pixel.light[1][c]));
    shown[c] += share * (light * reflectance[c] / scale_ - shown[c]);
  }
  return shown;
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
  const double unit = 1 / double(layer->scale_);
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      const Rgb shown = layer->shown(film, x, y, Rgb(tile.radiance[0][i], tile.radiance[1][i], tile.radiance[2][i]));
      for (int c = 0; c < 3; ++c) tile.display[c][i] = shown[c];
      if (layer->by_oidn()) continue;
      const float error = unpack_half(layer->blends_[layer->index(x, y)].error);
      double square = error < kMostHalf ? sqr(error * unit) : std::numeric_limits<double>::infinity();
      if (const FilmHistory* history = film.history())
        square += history->bias2(x, y, film.half(0, x, y).count, film.half(1, x, y).count);
      const double root = std::sqrt(square);
      tile.display_error[i] = root <= FLT_MAX ? float(root) : std::numeric_limits<float>::infinity();
    }
  }
}

}  // namespace helio
