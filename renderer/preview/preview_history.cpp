#include "renderer/preview/preview_history.h"

#include "renderer/preview/paper/paper_history.h"

namespace helio {

PreviewHistory::PreviewHistory(int width, int height, bool is_published) : width_(width), height_(height) {
  if (is_published) {
    published = std::make_unique<PaperHistory>(width, height);
    return;
  }
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  for (PreviewBuffer* buffer : {&rest, &last, &current}) buffer->pixels.resize(pixels);
  colors.resize(pixels, kWhite);
  colors_before.resize(pixels, kWhite);
  filtered.resize(pixels);
}

PreviewHistory::PreviewHistory(PreviewHistory&&) noexcept = default;
PreviewHistory::~PreviewHistory() = default;

std::size_t PreviewHistory::bytes_of(int width, int height, bool is_published) {
  return is_published ? PaperHistory::bytes(width, height)
                      : std::size_t(width) * std::size_t(height) * bytes_per_pixel();
}

void PreviewHistory::forget() {
  for (PreviewBuffer* buffer : {&rest, &last, &current}) buffer->forget();
  surface_colors.reset();
  colored_scene.reset();
  mean_light = Rgb(0, 0, 0);
  density_of_last.reset();
  if (published) published->forget();
}

}  // namespace helio
