#include "renderer/film/film_history.h"

#include <algorithm>
#include <limits>

#include "renderer/film/history_source.h"

namespace helio {

FilmHistory::FilmHistory(int width, int height, bool sources)
    : width_(width),
      carried_(std::size_t(width) * std::size_t(height)),
      centres_(sources ? carried_.size() : 0),
      directions_(centres_.size()) {
  if (!sources) return;
  for (std::unique_ptr<HistorySource>& source : sources_) source = std::make_unique<HistorySource>(width, height);
}

FilmHistory::~FilmHistory() = default;

void FilmHistory::clear(const PixelRect& window) {
  CentreHit unknown;
  unknown.depth = std::numeric_limits<float>::quiet_NaN();
  for (int y = window.y0; y < window.y1; ++y) {
    const std::size_t first = index(window.x0, y), width = std::size_t(window.width());
    std::fill_n(&carried_[first], width, CarriedPixel{});
    if (!has_centres()) continue;
    std::fill_n(&centres_[first], width, unknown);
    std::fill_n(&directions_[first], width, DirectionReservoir{});
  }
}

std::size_t FilmHistory::bytes_per_pixel(bool sources) {
  if (!sources) return sizeof(CarriedPixel);
  return sizeof(CarriedPixel) + sizeof(CentreHit) + sizeof(DirectionReservoir) +
         kSources * HistorySource::kBytesPerPixel;
}

std::size_t FilmHistory::bytes() const {
  std::size_t total = carried_.capacity() * sizeof(CarriedPixel) + centres_.capacity() * sizeof(CentreHit) +
                      directions_.capacity() * sizeof(DirectionReservoir);
  for (const std::unique_ptr<HistorySource>& source : sources_) total += source ? source->bytes() : 0;
  return total;
}

}  // namespace helio
