#include "renderer/preview/preview_history.h"

namespace helio {

PreviewHistory::PreviewHistory(int width, int height) : width_(width), height_(height) {
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (PreviewBuffer* buffer : {&rest, &last, &current}) buffer->pixels.resize(pixels);
  colors.resize(pixels, kWhite);
  colors_before.resize(pixels, kWhite);
  filtered.resize(pixels);
}

void PreviewHistory::forget() {
  for (PreviewBuffer* buffer : {&rest, &last, &current}) buffer->forget();
  surface_colors.reset();
  colored_scene.reset();
  mean_light = Rgb(0, 0, 0);
}

}  // namespace helio
