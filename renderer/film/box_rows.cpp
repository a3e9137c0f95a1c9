#include "renderer/film/box_rows.h"

namespace helio {
namespace {

// Always the same tree, from the first to the last.
inline void store_sum(const Float16 (&v)[kBoxSide], float* out) {
  store(((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + v[6]), out);
}

}  // namespace

void BoxRows::begin(int width) {
  width_ = round_up_to_vectors(width);
  input_.assign(std::size_t(width_ + 2 * kBoxRadius) * kLanes, 0.0f);
  zeroes_.assign(std::size_t(width_) * kLanes, 0.0f);
  for (std::vector<float>& row : sums_) row.resize(zeroes_.size());
  newest_ = empty_rows_ = 0;
}

void BoxRows::push(bool filled) {
  newest_ = (newest_ + 1) % kBoxSide;
  if (!filled) {
    ++empty_rows_;
    rows_[newest_] = zeroes_.data();
    return;
  }
  empty_rows_ = 0;
  float* out = sums_[newest_].data();
  rows_[newest_] = out;
  for (int x = 0; x < width_; x += kPixelsAtOnce) {
    Float16 v[kBoxSide];
    for (int i = 0; i < kBoxSide; ++i) load(input_.data() + (x + i) * kLanes, v[i]);
    store_sum(v, out + x * kLanes);
  }
}

void BoxRows::sum(float* out) const {
  const float* rows[kBoxSide];
  for (int i = 0; i < kBoxSide; ++i) rows[i] = rows_[(newest_ + 1 + i) % kBoxSide];
  for (int x = 0; x < width_ * kLanes; x += kPixelsAtOnce * kLanes) {
    Float16 v[kBoxSide];
    for (int i = 0; i < kBoxSide; ++i) load(rows[i] + x, v[i]);
    store_sum(v, out + x);
  }
}

}  // namespace helio
