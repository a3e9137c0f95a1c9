#include "renderer/film/estimate/similar_counts.h"

#include <algorithm>
#include <cfloat>

namespace helio {

void SimilarCounts::begin(int width) {
  width_ = width;
  next_ = 0;
  const auto pixels = std::size_t(width + 2 * kBoxRadius);
  const auto padded = pixels + 1;  // eight are looked at together
  for (Row& r : rows_) {
    r.counts.assign(padded, 0.0f);
    r.least.assign(std::size_t(width), FLT_MAX);
    r.most.assign(std::size_t(width), 0.0f);
    r.differences.assign(padded * kLanes, 0.0f);
    r.spreads.assign(padded * kLanes, 0.0f);
    r.row_least = FLT_MAX;
    r.row_most = 0;
    r.any = r.any_spread = false;
  }
}

void SimilarCounts::push(const float* differences, const float* spreads) {
  Row& r = row(0);
  r.any = differences != nullptr;
  r.any_spread = spreads != nullptr;
  const auto values = std::size_t(width_ + 2 * kBoxRadius) * kLanes;
  if (r.any) std::copy_n(differences, values, r.differences.data());
  if (r.any_spread) std::copy_n(spreads, values, r.spreads.data());
  r.row_least = FLT_MAX;
  r.row_most = 0;
  for (int x = 0; x < width_; ++x) {
    float least = FLT_MAX, most = 0;
    for (int i = 0; i < kBoxSide; ++i) {
      const float n = r.counts[std::size_t(x + i)];
      least = std::min(least, n > 0 ? n : FLT_MAX);
      most = std::max(most, n);
    }
    r.least[std::size_t(x)] = least;
    r.most[std::size_t(x)] = most;
    r.row_least = std::min(r.row_least, least);
    r.row_most = std::max(r.row_most, most);
  }
  next_ = (next_ + 1) % kRows;
  std::fill(row(0).counts.begin(), row(0).counts.end(), 0.0f);
}

bool SimilarCounts::all() const {
  float least = FLT_MAX, most = 0;
  for (int back = 1; back <= kBoxSide; ++back) {
    least = std::min(least, row(back).row_least);
    most = std::max(most, row(back).row_most);
  }
  return most <= kSimilar * least;
}

bool SimilarCounts::all(int x) const {
  const float own = this->own(x);
  if (own == 0) return true;
  float least = FLT_MAX, most = 0;
  for (int back = 1; back <= kBoxSide; ++back) {
    least = std::min(least, row(back).least[std::size_t(x)]);
    most = std::max(most, row(back).most[std::size_t(x)]);
  }
  return most <= kSimilar * own && own <= kSimilar * least;
}

void SimilarCounts::sum(int x, Float4& differences, Float4& spreads) const {
  const Float8 seven = {1, 1, 1, 1, 1, 1, 1, 0};
  const float own = this->own(x);
  Float16 sums[2] = {};
  for (int back = kBoxSide; back >= 1; --back) {
    const Row& r = row(back);
    if (!r.any) continue;
    Float8 n;
    load(r.counts.data() + x, n);
    n = ((n <= kSimilar * own) & (kSimilar * n >= own)) ? seven : Float8{};
    const Float16 left = __builtin_shufflevector(n, n, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    const Float16 right = __builtin_shufflevector(n, n, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7);
    const std::vector<float>* terms[2] = {&r.differences, &r.spreads};
    for (int i = 0; i < (r.any_spread ? 2 : 1); ++i) {
      const float* from = terms[i]->data() + x * kLanes;
      Float16 first, last;
      load(from, first);
      load(from + kPixelsAtOnce * kLanes, last);
      sums[i] += first * left + last * right;
    }
  }
  const auto fold = [](const Float16& pixels, Float4& out) {
    const Float8 two = __builtin_shufflevector(pixels, pixels, 0, 1, 2, 3, 4, 5, 6, 7) +
                       __builtin_shufflevector(pixels, pixels, 8, 9, 10, 11, 12, 13, 14, 15);
    out = __builtin_shufflevector(two, two, 0, 1, 2, 3) + __builtin_shufflevector(two, two, 4, 5, 6, 7);
  };
  fold(sums[0], differences);
  fold(sums[1], spreads);
}

}  // namespace helio
