#include "renderer/film/core/box_rows.h"

namespace helio {
namespace {

// Always the same tree, from the first to the last: the sums of neighbours first, each of which serves three windows.
inline void store_sum(const Float16& first_two, const Float16& next_two, const Float16& third_two, const Float16& last,
                      float* out) {
  store((first_two + next_two) + (third_two + last), out);
}

}  // namespace

void BoxRows::begin(int width) {
  width_ = round_up_to_vectors(width);
  const auto vectors = std::size_t(width_ / kPixelsAtOnce);
  input_.assign(std::size_t(width_ + 2 * kBoxRadius) * kLanes, 0.0f);
  zeroes_.assign(vectors, Pixels{});
  for (Row& row : rows_) {
    row.sums.resize(vectors);
    row.two.resize(vectors);
    row.zero = true;
  }
  newest_ = empty_rows_ = 0;
}

void BoxRows::push(bool filled) {
  const Row& before = rows_[newest_];
  newest_ = (newest_ + 1) % kBoxSide;
  Row& row = rows_[newest_];
  row.zero = !filled;
  empty_rows_ = filled ? 0 : empty_rows_ + 1;
  if (!filled) {
    if (!before.zero) row.two = before.sums;
    return;
  }
  // two[x] = input[x] + input[x + 1]; those two, four and six further on are made of the vector in hand and the next.
  const auto two_at = [this](int x, Float16& two) {
    Float16 left, right;
    load(input_.data() + x * kLanes, left);
    load(input_.data() + (x + 1) * kLanes, right);
    two = left + right;
  };
  const Pixels* above = before.zero ? zeroes_.data() : before.sums.data();
  Float16 two, next, between, last, sum, sum_above;
  two_at(0, two);
  for (int x = 0; x < width_; x += kPixelsAtOnce) {
    const int i = x / kPixelsAtOnce;
    two_at(x + kPixelsAtOnce, next);
    between = __builtin_shufflevector(two, next, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23);
    load(input_.data() + (x + kBoxSide - 1) * kLanes, last);
    store_sum(two, between, next, last, row.sums[std::size_t(i)].lanes);
    load(row.sums[std::size_t(i)].lanes, sum);
    load(above[i].lanes, sum_above);
    store(sum_above + sum, row.two[std::size_t(i)].lanes);
    two = next;
  }
}

void BoxRows::sum(float* out) const {
  const auto at = [this](int i) -> const Row& { return rows_[(newest_ + 1 + i) % kBoxSide]; };  // 0: the oldest
  const auto two = [&](int i) { return at(i).zero && at(i - 1).zero ? zeroes_.data() : at(i).two.data(); };
  const Pixels *first = two(1), *next = two(3), *third = two(5);
  const Pixels* newest = at(6).zero ? zeroes_.data() : at(6).sums.data();
  for (int i = 0; i < width_ / kPixelsAtOnce; ++i) {
    Float16 a, b, c, d;
    load(first[i].lanes, a);
    load(next[i].lanes, b);
    load(third[i].lanes, c);
    load(newest[i].lanes, d);
    store_sum(a, b, c, d, out + i * kPixelsAtOnce * kLanes);
  }
}

}  // namespace helio
