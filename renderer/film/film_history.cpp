#include "renderer/film/film_history.h"

#include "renderer/film/history_source.h"

namespace helio {

FilmHistory::FilmHistory(int width, int height)
    : width_(width), carried_(std::size_t(width) * std::size_t(height)), centres_(carried_.size()) {
  for (std::unique_ptr<HistorySource>& source : sources_) source = std::make_unique<HistorySource>(width, height);
}

FilmHistory::~FilmHistory() = default;

std::size_t FilmHistory::bytes_per_pixel() {
  return sizeof(CarriedPixel) + sizeof(CentreHit) + kSources * HistorySource::kBytesPerPixel;
}

std::size_t FilmHistory::bytes() const {
  std::size_t total = carried_.capacity() * sizeof(CarriedPixel) + centres_.capacity() * sizeof(CentreHit);
  for (const std::unique_ptr<HistorySource>& source : sources_) total += source->bytes();
  return total;
}

}  // namespace helio
