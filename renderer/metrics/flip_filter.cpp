#include "renderer/metrics/flip_filter.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "renderer/metrics/flip_color.h"

namespace helio {
namespace {

// So many pixels are filtered together.
constexpr int kBlock = 16;
// Their sums. A vector type, which g++ and clang have for every processor: an array of as many floats g++ keeps in
// memory from one tap to the next.
using Block [[gnu::vector_size(kBlock * sizeof(float))]] = float;

// One block of out = the even filter along taps; `at(i)` points to the block's values i places further.
template <class At>
void filter_even(const HalfKernel& kernel, const At& at, float* out) {
  Block sum, before, after;
  std::memcpy(&sum, at(0), sizeof(sum));
  sum *= kernel[0];
  for (int i = 1; i < int(kernel.size()); ++i) {
    std::memcpy(&before, at(-i), sizeof(before));
    std::memcpy(&after, at(i), sizeof(after));
    sum += kernel[std::size_t(i)] * (before + after);
  }
  std::memcpy(out, &sum, sizeof(sum));
}

// The same for an odd filter.
template <class At>
void filter_odd(const HalfKernel& kernel, const At& at, float* out) {
  Block sum = {}, before, after;
  for (int i = 1; i < int(kernel.size()); ++i) {
    std::memcpy(&before, at(-i), sizeof(before));
    std::memcpy(&after, at(i), sizeof(after));
    sum += kernel[std::size_t(i)] * (after - before);
  }
  std::memcpy(out, &sum, sizeof(sum));
}

// The same for an even filter whose taps sum to 0: exactly 0 where all values are equal.
template <class At>
void filter_differences(const HalfKernel& kernel, const At& at, float* out) {
  Block sum = {}, middle, before, after;
  std::memcpy(&middle, at(0), sizeof(middle));
  for (int i = 1; i < int(kernel.size()); ++i) {
    std::memcpy(&before, at(-i), sizeof(before));
    std::memcpy(&after, at(i), sizeof(after));
    sum += kernel[std::size_t(i)] * ((before - middle) + (after - middle));
  }
  std::memcpy(out, &sum, sizeof(sum));
}

void to_opponent(const float* __restrict r, const float* __restrict g, const float* __restrict b,
                 float* __restrict luma, float* __restrict red_green, float* __restrict blue_yellow, int width) {
  for (int x = 0; x < width; ++x) {
    const float white_x = kWhiteXFromRgb[0] * r[x] + kWhiteXFromRgb[1] * g[x] + kWhiteXFromRgb[2] * b[x];
    const float white_y = kWhiteYFromRgb[0] * r[x] + kWhiteYFromRgb[1] * g[x] + kWhiteYFromRgb[2] * b[x];
    const float white_z = kWhiteZFromRgb[0] * r[x] + kWhiteZFromRgb[1] * g[x] + kWhiteZFromRgb[2] * b[x];
    luma[x] = white_y;
    red_green[x] = white_x - white_y;
    blue_yellow[x] = white_y - white_z;
  }
}

void extend(std::vector<float>& row, int radius, int width) {
  std::fill_n(row.begin(), radius, row[std::size_t(radius)]);
  std::fill(row.begin() + radius + width, row.end(), row[std::size_t(radius + width - 1)]);
}

}  // namespace

FlipFilter::FlipFilter(const FlipKernels& kernels, int width, int height)
    : kernels_(kernels), width_(width), height_(height), radius_(kernels.radius), blocks_((width - 1) / kBlock + 1) {
  const std::size_t padded = std::size_t(blocks_) * kBlock;
  color_row_.resize(3 * padded);
  for (std::size_t c = 0; c < 3; ++c) {
    color_[c] = &color_row_[c * padded];
    opponent_[c].resize(padded + 2 * std::size_t(radius_));
  }
  rows_.resize(std::size_t(kPlanes) * std::size_t(2 * radius_ + 1) * padded);
  around_.resize(std::size_t(2 * radius_ + 1));
  for (auto* values : {&row_.y, &row_.cx, &row_.cz, &row_.edge, &row_.point}) values->resize(padded);
}

float* FlipFilter::stored(Plane plane, int y) {
  const std::size_t held = std::size_t(2 * radius_ + 1);
  return &rows_[(std::size_t(plane) * held + std::size_t(y) % held) * std::size_t(blocks_) * kBlock];
}

const FlipFilter::Row& FlipFilter::row(int y, const FlipRows& rows) {
  if (y == 0) filled_ = 0;
  for (; filled_ < height_ && filled_ <= y + radius_; ++filled_) {
    rows(filled_, color_);
    filter_across(filled_);
  }
  filter_down(y);
  return row_;
}

void FlipFilter::filter_across(int y) {
  float* luma = opponent_[0].data() + radius_;
  float* red_green = opponent_[1].data() + radius_;
  float* blue_yellow = opponent_[2].data() + radius_;
  to_opponent(color_[0], color_[1], color_[2], luma, red_green, blue_yellow, width_);
  for (auto& row : opponent_) extend(row, radius_, width_);

  for (int x = 0; x < blocks_ * kBlock; x += kBlock) {
    const auto at = [x](const float* row) { return [row, x](int i) { return row + x + i; }; };
    filter_even(kernels_.achromatic, at(luma), stored(kY, y) + x);
    filter_even(kernels_.red_green, at(red_green), stored(kCx, y) + x);
    filter_even(kernels_.blue_yellow[0].horizontal, at(blue_yellow), stored(kCz0, y) + x);
    filter_even(kernels_.blue_yellow[1].horizontal, at(blue_yellow), stored(kCz1, y) + x);
    filter_even(kernels_.gaussian, at(luma), stored(kGaussian, y) + x);
    filter_odd(kernels_.first, at(luma), stored(kFirst, y) + x);
    filter_differences(kernels_.second, at(luma), stored(kSecond, y) + x);
  }
}

void FlipFilter::filter_down(int y) {
  const auto rows = [&](Plane plane) {
    for (int i = -radius_; i <= radius_; ++i)
      around_[std::size_t(i + radius_)] = stored(plane, std::clamp(y + i, 0, height_ - 1));
  };
  const auto at = [this](int x) { return [this, x](int i) { return around_[std::size_t(i + radius_)] + x; }; };
  const int padded = blocks_ * kBlock;
  float part[kBlock];

  rows(kY);
  for (int x = 0; x < padded; x += kBlock) filter_even(kernels_.achromatic, at(x), &row_.y[std::size_t(x)]);
  rows(kCx);
  for (int x = 0; x < padded; x += kBlock) filter_even(kernels_.red_green, at(x), &row_.cx[std::size_t(x)]);
  rows(kCz0);
  for (int x = 0; x < padded; x += kBlock)
    filter_even(kernels_.blue_yellow[0].vertical, at(x), &row_.cz[std::size_t(x)]);
  rows(kCz1);
  for (int x = 0; x < padded; x += kBlock) {
    filter_even(kernels_.blue_yellow[1].vertical, at(x), part);
    for (int l = 0; l < kBlock; ++l) row_.cz[std::size_t(x + l)] += part[l];
  }

  // Squares of the derivatives across, then those down, then the roots of their sums.
  const auto add_square = [&](float* sum, bool first) {
    for (int l = 0; l < kBlock; ++l) sum[l] = (first ? 0 : sum[l]) + part[l] * part[l];
  };
  rows(kFirst);
  for (int x = 0; x < padded; x += kBlock) {
    filter_even(kernels_.gaussian, at(x), part);
    add_square(&row_.edge[std::size_t(x)], true);
  }
  rows(kSecond);
  for (int x = 0; x < padded; x += kBlock) {
    filter_even(kernels_.gaussian, at(x), part);
    add_square(&row_.point[std::size_t(x)], true);
  }
  rows(kGaussian);
  for (int x = 0; x < padded; x += kBlock) {
    filter_odd(kernels_.first, at(x), part);
    add_square(&row_.edge[std::size_t(x)], false);
    filter_differences(kernels_.second, at(x), part);
    add_square(&row_.point[std::size_t(x)], false);
  }
  for (float& value : row_.edge) value = std::sqrt(value);
  for (float& value : row_.point) value = std::sqrt(value);
}

}  // namespace helio
