#include "renderer/film/estimate/variance_pool.h"

#include <algorithm>
#include <cfloat>

#include "renderer/base/check.h"
#include "renderer/film/core/box_rows.h"
#include "renderer/film/estimate/similar_counts.h"
#include "renderer/film/estimate/spatial_variance.h"

namespace helio {
namespace {

// D where q is unknown, of four pixels; the fourth lanes mean nothing.
void pool(const Float16& differences, Float16& n, Float16& pooled) {
  spread_last(differences, n);
  const Float16 one = Float16{} + 1.0f;
  pooled = differences * (one / (n < one ? one : n));
}

void store_estimates(const Float16& differences, const Float16& pooled, std::size_t x, std::vector<float> (&out)[3]) {
  const Float16 low = Float16{} + FLT_MIN;
  const Float16 clamped = pooled < low ? low : pooled;
  store_planar(differences > 0.0f ? clamped : Float16{}, out[0].data() + x, out[1].data() + x, out[2].data() + x);
}

// D of a row of `width` pixels.
void estimate_row(int width, const float* difference_sums, std::vector<float> (&out)[3]) {
  for (int x = 0; x < width; x += kPixelsAtOnce) {
    Float16 differences, n, pooled;
    load(difference_sums + x * kLanes, differences);
    pool(differences, n, pooled);
    store_estimates(differences, pooled, std::size_t(x), out);
  }
}

// D (1/2 + 1/2 q/Q) from the sums over the neighbourhood and the pixel's own q.
void estimate_row(int width, const float* difference_sums, const float* spread_sums, const float* spreads,
                  std::vector<float> (&out)[3]) {
  for (int x = 0; x < width; x += kPixelsAtOnce) {
    Float16 differences, n, pooled, total, known, own;
    load(difference_sums + x * kLanes, differences);
    load(spread_sums + x * kLanes, total);
    load(spreads + x * kLanes, own);
    pool(differences, n, pooled);
    spread_last(total, known);
    const Float16 ratio = total > 0.0f ? own * n / total : Float16{} + 1.0f;
    const Float16 shaped = pooled * (0.5f + 0.5f * ratio);
    store_estimates(differences, n == known ? shaped : pooled, std::size_t(x), out);
  }
}

// Row by row: what a row of the window needs is mostly what the row before needed.
class Pool {
 public:
  void begin(const Film& film, const PixelRect& window, const PixelRect& roi) {
    film_ = &film;
    window_ = window;
    border_ = with_box_border(window);
    read_ = intersect(border_, roi);
    whole_rows_ = read_.x0 <= window.x0 && read_.x1 >= window.x1;
    const int width = window.width();
    const auto pixels = std::size_t(round_up_to_vectors(width));
    differences_.begin(width);
    spreads_.begin(width);
    spatial_.begin(film, window, roi);
    difference_sums_.resize(pixels * kLanes);
    spread_sums_.resize(pixels * kLanes);
    counts_differ_ = film.state().counts_differ();
    for (Row& row : rows_) row.spreads.assign(pixels * kLanes, 0.0f);
    if (counts_differ_) similar_.begin(width);
    for (std::vector<float>& channel : pooled_) channel.resize(pixels);
  }

  // Rows of the window and its border, from top to bottom.
  void add_row(int y, const RowVisitor& visit_row) {
    const bool readable = !read_.empty() && y >= read_.y0 && y < read_.y1;
    if (readable) {
      const int shift = (read_.x0 - border_.x0) * kLanes;
      look_.look(*film_, y, read_.x0, read_.x1, differences_.input() + shift, spreads_.input() + shift);
    }
    const bool any_paired = readable && look_.any_paired(), any_spread = readable && look_.any_spread();
    differences_.push(any_paired);
    spreads_.push(any_spread);
    if (counts_differ_) {
      if (any_paired) look_.copy_counts(read_.x0, read_.x1, similar_.counts() + (read_.x0 - border_.x0));
      similar_.push(any_paired ? differences_.input() : nullptr, any_spread ? spreads_.input() : nullptr);
    }
    if (y < window_.y0 || y >= window_.y1) return;

    Row& row = row_at(y);
    const float* spreads = spreads_.input() + kBoxRadius * kLanes;
    if (any_spread) std::copy_n(spreads, std::size_t(window_.width()) * kLanes, row.spreads.data());
    if (!any_spread) std::fill(row.spreads.begin(), row.spreads.end(), 0.0f);
    const bool whole = readable && whole_rows_;
    row.unpaired = !whole || look_.any_unpaired();
    if (!whole) look_.look(*film_, y, window_.x0, window_.x1);
    visit_row(look_);
  }

  // A row of the window; the newest row is kBoxRadius further down.
  void append_variance(int y, std::vector<float> (&variance)[3]) {
    const int width = window_.width();
    const Row& row = row_at(y);
    if (!differences_.empty()) {
      differences_.sum(difference_sums_.data());
      if (spreads_.empty()) {
        estimate_row(width, difference_sums_.data(), pooled_);
      } else {
        spreads_.sum(spread_sums_.data());
        estimate_row(width, difference_sums_.data(), spread_sums_.data(), row.spreads.data(), pooled_);
      }
    }
    if (counts_differ_ && !differences_.empty()) {
      const bool all_similar = similar_.all();
      for (int x = 0; !all_similar && x < width; ++x) {
        if (!similar_.all(x)) estimate_of_similar(x, row.spreads.data() + x * kLanes);
      }
      for (int x = 0; x < width; ++x) {
        const float n = similar_.own(x);
        for (std::vector<float>& channel : pooled_) {
          float& variance = channel[std::size_t(x)];
          if (variance > 0 && n > 0) variance = std::max(variance / n, FLT_MIN);
        }
      }
    }
    if (row.unpaired) spatial_.fill_row(y, {pooled_[0].data(), pooled_[1].data(), pooled_[2].data()});
    for (int c = 0; c < 3; ++c) variance[c].insert(variance[c].end(), pooled_[c].begin(), pooled_[c].begin() + width);
  }

 private:
  // Overwrites pooled_ where neighbours have other counts.
  void estimate_of_similar(int x, const float* own_spread) {
    Float4 all, similar, spread, own;
    load(difference_sums_.data() + x * kLanes, all);
    load(own_spread, own);
    similar_.sum(x, similar, spread);
    const float n = similar[3];
    for (int c = 0; c < 3; ++c) {
      if (all[c] == 0) continue;
      const float pooled = (similar[c] + all[c] / all[3]) / (n + 1);
      const float ratio = spread[c] > 0 ? own[c] * n / spread[c] : 1.0f;
      const float shaped = n == spread[3] ? pooled * (0.5f + 0.5f * ratio) : pooled;
      pooled_[c][std::size_t(x)] = std::max(shaped, FLT_MIN);
    }
  }

  // What is kept of a row of the window until the rows below it are in.
  struct Row {
    std::vector<float> spreads;
    bool unpaired = false;  // some pixel lacks a half or is outside the region
  };
  Row& row_at(int y) { return rows_[(y - window_.y0) % (kBoxRadius + 1)]; }

  const Film* film_ = nullptr;
  PixelRect window_, border_, read_;
  bool whole_rows_ = false, counts_differ_ = false;
  PixelRow look_;
  BoxRows differences_, spreads_;
  Row rows_[kBoxRadius + 1];
  SimilarCounts similar_;
  SpatialVariance spatial_;
  std::vector<float> difference_sums_, spread_sums_, pooled_[3];
};

}  // namespace

void pool_variance(const Film& film, const PixelRect& window, const PixelRect& roi, const RowVisitor& visit_row,
                   std::vector<float> (&variance)[3]) {
  HELIO_DCHECK(intersect(window, film.bounds()) == window && intersect(roi, film.bounds()) == roi);
  thread_local Pool pool;  // kept: its memory would cost more to allocate than to fill
  pool.begin(film, window, roi);
  for (std::vector<float>& channel : variance) channel.reserve(std::size_t(window.area()));
  for (int y = window.y0 - kBoxRadius; y < window.y1 + kBoxRadius; ++y) {
    pool.add_row(y, visit_row);
    if (y - kBoxRadius >= window.y0) pool.append_variance(y - kBoxRadius, variance);
  }
}

}  // namespace helio
