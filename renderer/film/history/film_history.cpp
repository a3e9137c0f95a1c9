#include "renderer/film/history/film_history.h"

#include <algorithm>
#include <limits>

#include "renderer/film/history/history_source.h"

namespace helio {
namespace {

constexpr double kLargestMean = 1e15;  // of differences, whose squares are wanted

}  // namespace

FilmHistory::FilmHistory(int width, int height, bool sources)
    : width_(width),
      carried_(std::size_t(width) * std::size_t(height)),
      centres_(sources ? carried_.size() : 0),
      directions_(centres_.size()) {
  clear({0, 0, width, height});
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

void FilmHistory::drop(int h, int x, int y, HalfPixel& half) {
  CarriedPixel& carried = this->carried(x, y);
  const double before = half.count, old = carried.count[h], fresh = before - old;
  const Rgb mean = carried.means.mean(h);
  carried.count[h] = 0;
  if (fresh == 0) {
    half = {};
    return;
  }
  for (int c = 0; c < 3; ++c) {
    const double m = double(mean[c]), sum = std::max(0.0, half.sum[c] - m * old);
    // Of what scatters inside the two groups, on the mean of all samples, and not between them.
    const double off = std::clamp(sum / fresh - m, -kLargestMean, kLargestMean);
    const double inside = std::max(0.0, half.deviations[c] - old * fresh / before * off * off);
    half.sum[c] = sum;
    half.deviations[c] = float(inside * (fresh - 1) / std::max(before - 2, 1.0));
  }
  half.count = std::uint32_t(fresh);
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
