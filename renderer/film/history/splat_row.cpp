#include "renderer/film/history/splat_row.h"

#include "renderer/film/history/film_history.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {

void SplatRow::look(const Film& film, int half, int y, int x0, int x1, bool spreads) {
  any_ = film.splats() != nullptr;
  if (!any_) return;
  x0_ = x0;
  const std::size_t values = std::size_t(std::max(x1 - x0, 0)) * kLanes;
  means_.resize(values);
  if (spreads) {
    variances_.resize(values);
    deviations_.assign(values, 0.0);
  }
  film.splats()->read_row(half, y, x0, x1, means_.data(), spreads ? variances_.data() : nullptr);
  for (int x = x0; film.history() && x < x1; ++x) {
    const CarriedPixel& carried = film.history()->carried(x, y);
    if (carried.count[half] == 0) continue;
    const HalfPixel& pixel = film.half(half, x, y);
    const double fresh = double(pixel.count) - carried.count[half], share = fresh / pixel.count;
    const Rgb means = carried.means.mean(half);
    for (std::size_t i = at(x), c = 0; c < 3; ++i, ++c) {
      const double whole = means_[i];
      means_[i] *= share;
      if (!spreads) continue;
      variances_[i] *= share * share;
      if (fresh == 0) continue;
      const double mean = double(means[int(c)]);
      const double off = mean - (pixel.sum[c] - carried.count[half] * mean) / fresh;
      deviations_[i] = share * carried.count[half] * whole * (whole - 2 * off);
    }
  }
}

}  // namespace helio
