#include "renderer/preview/film_capture.h"

#include <algorithm>

#include "renderer/film/estimate/resolve.h"

namespace helio {
namespace {

// Samples that a preview's light counts for at most beside the film's, and where it only filled a gap.
constexpr float kMostKept = 8, kFilledKept = 0.5f;

}  // namespace

void capture_film(const Film& film, const DisplayLayer* display, const PixelRect& window, PreviewHistory& history) {
  const bool filtered = display && display->covers(window);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = history.index(x, y);
      PreviewPixel& pixel = history.rest.pixels[i];
      pixel = history.last.pixels[i];
      if (pixel.samples == kExactSamples) continue;
      const float samples = float(film.half(0, x, y).count) + float(film.half(1, x, y).count);
      if (!(samples > 0)) continue;
      Rgb mean = resolve_mean(film, x, y);
      if (!is_finite(mean)) continue;
      if (filtered) mean = display->shown(film, x, y, mean);
      const Rgb light = mean / unpack_color(history.colors[i]);
      const float kept = pixel.samples > 0 ? std::min(float(pixel.samples), kMostKept) : kFilledKept;
      const float share = samples / (samples + kept);
      pixel.set_light(light * share + pixel.unpacked_light() * (1 - share));
      pixel.set_samples(samples + float(pixel.samples));
    }
  }
}

}  // namespace helio
