#include "renderer/film/estimate/spatial_variance.h"

#include <algorithm>
#include <limits>

#include "renderer/film/estimate/variance_term.h"

namespace helio {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::infinity();

// Half the squared difference to the right and the lower neighbour, averaged over those that have samples.
void store_spatial_term(const double* row, const double* below, float* term) {
  Double4 here, right, down;
  load(row, here);
  load(row + kLanes, right);
  load(below, down);
  if (here[3] == 0 || (right[3] == 0 && down[3] == 0)) {
    store(Float4{}, term);
    return;
  }
  const Double4 to_right = here - right, to_down = here - down;
  Double4 sum = right[3] > 0 ? 0.5 * to_right * to_right : Double4{};
  if (down[3] > 0) sum += 0.5 * to_down * to_down;
  store_term(right[3] > 0 && down[3] > 0 ? 0.5 * sum : sum, 1.0f, term);
}

// The same where all three have samples.
void store_whole_term(const double* row, const double* below, float* term) {
  Double4 here, right, down;
  load(row, here);
  load(row + kLanes, right);
  load(below, down);
  const Double4 to_right = here - right, to_down = here - down;
  store_term(0.5 * (0.5 * to_right * to_right + 0.5 * to_down * to_down), 1.0f, term);
}

}  // namespace

void SpatialVariance::Means::look(const Film& film, int y, int x0, int x1) {
  const int width = x1 - x0;
  data.resize(std::size_t(width + 1) * kLanes);
  complete = true;
  const HalfPixel* a = &film.half(0, x0, y);
  const HalfPixel* b = &film.half(1, x0, y);
  for (int x = 0; x < width;) {
    const std::uint32_t count_a = a[x].count, count_b = b[x].count;
    const double halves = double(count_a > 0) + double(count_b > 0);
    const Double4 weight_a = Double4{} + (count_a > 0 ? 1 / (halves * count_a) : 0);
    const Double4 weight_b = Double4{} + (count_b > 0 ? 1 / (halves * count_b) : 0);
    complete &= halves > 0;
    do {
      Double4 sum_a, sum_b;
      load(&a[x], sum_a);
      load(&b[x], sum_b);
      Double4 mean = sum_a * weight_a + sum_b * weight_b;
      mean[3] = halves;
      store(mean, at(x));
      ++x;
    } while (x < width && a[x].count == count_a && b[x].count == count_b);
  }
  store(Double4{}, at(width));
  if (!film.splats()) return;
  for (int h = 0; h < kHalves; ++h) {
    splats.look(film, h, y, x0, x1, false);
    for (int x = 0; x < width; ++x) {
      if (film.half(h, x0 + x, y).count == 0) continue;
      const double halves = at(x)[3];
      for (int c = 0; c < 3; ++c) at(x)[c] += splats.mean(x0 + x, c) / halves;
    }
  }
}

void SpatialVariance::Means::clear(int width) {
  data.assign(std::size_t(width + 1) * kLanes, 0.0);
  complete = false;
}

void SpatialVariance::begin(const Film& film, const PixelRect& window, const PixelRect& roi) {
  film_ = &film;
  window_ = window;
  roi_ = roi;
  const PixelRect border = with_box_border(window);
  x0_ = std::max(border.x0, roi.x0);
  x1_ = std::min(border.x1, roi.x1);
  pushed_ = border.y0 - 1;
}

// Terms of the last column need the one behind it.
void SpatialVariance::look(int y, Means& means) const {
  const int end = std::min(x1_ + 1, roi_.x1);
  if (y >= roi_.y0 && y < roi_.y1) {
    means.look(*film_, y, x0_, end);
  } else {
    means.clear(end - x0_);
  }
}

void SpatialVariance::push(int y) {
  std::swap(here_, below_);
  look(y + 1, below_);
  if (y < roi_.y0 || y >= roi_.y1) {
    terms_.push(false);
    return;
  }
  float* terms = terms_.input() + (x0_ - (window_.x0 - kBoxRadius)) * kLanes;
  const int width = x1_ - x0_;
  int x = 0;
  if (here_.complete && below_.complete) {
    for (; x + 1 < width; ++x) store_whole_term(here_.at(x), below_.at(x), terms + x * kLanes);
  }
  for (; x < width; ++x) store_spatial_term(here_.at(x), below_.at(x), terms + x * kLanes);
  terms_.push(true);
}

void SpatialVariance::fill_row(int y, float* const (&variance)[3]) {
  const int width = window_.width();
  if (x0_ >= x1_) {
    for (float* channel : variance) std::fill_n(channel, width, kUnknown);
    return;
  }
  if (pushed_ < y - kBoxRadius) {  // nothing of what is in is of use
    pushed_ = y - kBoxRadius;
    terms_.begin(width);
    look(pushed_, below_);
    const auto padded = std::size_t(round_up_to_vectors(width));
    sums_.resize(padded * kLanes);
    for (std::vector<float>& channel : estimates_) channel.resize(padded);
  }
  for (; pushed_ <= y + kBoxRadius; ++pushed_) push(pushed_);

  terms_.sum(sums_.data());
  for (int x = 0; x < width; x += kPixelsAtOnce) {
    Float16 sums, n;
    load(sums_.data() + x * kLanes, sums);
    spread_last(sums, n);
    const auto at = std::size_t(x);
    store_planar(n > 0.0f ? sums / n : Float16{} + kUnknown, estimates_[0].data() + at, estimates_[1].data() + at,
                 estimates_[2].data() + at);
  }
  enum class Kind { paired, single, none };
  const auto kind = [&](int x) {
    if (!roi_.contains(window_.x0 + x, y)) return Kind::none;
    const bool a = film_->half(0, window_.x0 + x, y).count > 0, b = film_->half(1, window_.x0 + x, y).count > 0;
    return a && b ? Kind::paired : a || b ? Kind::single : Kind::none;
  };
  for (int x = 0; x < width;) {
    const Kind same = kind(x);
    const int begin = x;
    do {
      ++x;
    } while (x < width && kind(x) == same);
    for (int c = 0; c < 3; ++c) {
      if (same == Kind::single) std::copy_n(estimates_[c].data() + begin, x - begin, variance[c] + begin);
      if (same == Kind::none) std::fill_n(variance[c] + begin, x - begin, kUnknown);
    }
  }
}

}  // namespace helio
