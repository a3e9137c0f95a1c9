#include "renderer/film/display/oidn_images.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <utility>

#include "renderer/film/estimate/pixel_row.h"

namespace helio {
namespace {

// Within [low, high]; 0 for NaN.
float within(float value, float low, float high) {
  return std::isnan(value) ? 0 : std::clamp(value, low, high);
}

}  // namespace

OidnImages::OidnImages(std::shared_ptr<const OidnLibrary> library, int width, int height)
    : library_(std::move(library)) {
  const std::size_t floats = 3 * std::size_t(width) * std::size_t(height);
  for (std::vector<float>* image : {&color_, &albedo_, &normal_, &output_}) image->resize(floats);
}

std::size_t OidnImages::bytes(std::size_t pixels) {
  return 4 * 3 * sizeof(float) * pixels + OidnLibrary::scratch_bytes(pixels);
}

void OidnImages::copy(const Film& film, const PixelRect& window) {
  thread_local PixelRow row;
  thread_local std::vector<float> means[3];
  for (int y = window.y0; y < window.y1; ++y) {
    for (std::vector<float>& channel : means) channel.clear();
    row.look(film, y, window.x0, window.x1);
    row.append_means(window.x0, window.x1, means);
    std::size_t to = index(window.x0, y);
    for (int x = window.x0; x < window.x1; ++x, to += 3) {
      const PixelFeatures& features = film.features(x, y);
      const bool samples = film.half(0, x, y).count > 0 || film.half(1, x, y).count > 0;
      for (std::size_t c = 0; c < 3; ++c) {
        color_[to + c] = samples ? within(means[c][std::size_t(x - window.x0)], 0, FLT_MAX) : 0;
        albedo_[to + c] = samples ? within(features.albedo[c], 0, 1) : 0;
        normal_[to + c] = samples ? within(features.normal[c], -1, 1) : 0;
      }
    }
  }
}

Status OidnImages::denoise(const CancelToken* cancel) {
  return library_->denoise(
      {region_.width(), region_.height(), color_.data(), albedo_.data(), normal_.data(), output_.data()}, cancel);
}

Rgb OidnImages::output(int x, int y) const {
  const float* const pixel = output_.data() + index(x, y);
  return Rgb(within(pixel[0], 0, FLT_MAX), within(pixel[1], 0, FLT_MAX), within(pixel[2], 0, FLT_MAX));
}

}  // namespace helio
