#include "renderer/film/splats/splat_buffer.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <vector>

#include "renderer/base/check.h"
#include "renderer/film/core/pixel_hash.h"

namespace helio {
namespace {

__extension__ using Int128 = __int128;
__extension__ using Unsigned128 = unsigned __int128;

constexpr double kQuantum = 0x1p-60, kLargest = 0x1p55;
constexpr std::uint32_t kFetchedAhead = 8;  // splats land on pixels far apart
constexpr double kSquareQuantum = 0x1p-48, kLargestSquare = 0x1p79;

// Of a whole number. The compiler's own conversion is a call of a library's, and most numbers are small.
template <typename Wide>
Wide to_wide(double whole) {
  return std::abs(whole) < 0x1p63 ? Wide(std::int64_t(whole)) : Wide(whole);
}

// Neither depends on anything but the value.
Int128 to_fixed(double value) {
  const double quanta = value * (1 / kQuantum);
  const double rounded = std::nearbyint(quanta);
  if (rounded == 0 && quanta != 0) return quanta > 0 ? 1 : -1;
  return to_wide<Int128>(rounded);
}
Unsigned128 to_fixed_square(double value) {
  const double square = std::min(value * value, kLargestSquare);
  return to_wide<Unsigned128>(std::ceil(square * (1 / kSquareQuantum)));
}

// min(a + b, largest) of terms that are not negative is the same in any order.
void add_saturated(Unsigned128& sum, Unsigned128 term) {
  sum = sum + term < sum ? ~Unsigned128(0) : sum + term;
}

// Of competing exponential clocks with rates w the first to ring is one of those with probability w / sum (Efraimidis
// and Spirakis 2006, "Weighted random sampling with a reservoir"), and the earliest of all does not depend on the
// order: the time's bits, which sort as it does, above those of what it tells, a direction and a share. Rates are
// luminances, and not what splats count as directions do, so that the share of the one that is told is in the mean that
// of all.
constexpr int kDirectionBits = 2 * DirectionReservoir::kAxisBits, kToldBits = kDirectionBits + 8;
constexpr std::uint64_t kNoDirection = ~std::uint64_t(0);
static_assert(32 + kToldBits <= 64);
std::uint64_t ring(const Splat& splat, int half) {
  const float rate = luminance(splat.radiance);
  if (!(rate > 0)) return kNoDirection;
  const std::uint64_t told = std::uint64_t(pack_share(splat.told.share)) << kDirectionBits |
                             (splat.told.direction & ((1u << kDirectionBits) - 1));
  const std::uint64_t bits =
      hash64(std::uint64_t(std::bit_cast<std::uint32_t>(rate)) << 32 | told << 1 | std::uint64_t(half));
  const double u = double(hash64(bits ^ pixel_bits(splat.x, splat.y)) >> 11) * 0x1p-53;  // [0, 1)
  const auto time = std::bit_cast<std::uint32_t>(float(std::min(-std::log1p(-u) / double(rate), double(FLT_MAX))));
  return std::uint64_t(time) << kToldBits | told;
}

}  // namespace

// Left as memory is found until its stripe is prepared.
struct SplatBuffer::Pixel {
  Int128 sum[3];
  Unsigned128 squares[3];

  bool operator==(const Pixel&) const = default;
};

// P.
static double rounded_pixels(int width, int height) {
  return double(std::bit_ceil(std::size_t(width) * std::size_t(height)));
}

SplatBuffer::SplatBuffer(int width, int height, bool directions)
    : width_(width), height_(height), stripes_((height + kStripeRows - 1) / kStripeRows) {
  HELIO_DCHECK(width > 0 && height > 0);
  static_assert(kSumBytes == sizeof(Pixel) && kBytesPerPixel == 2 * sizeof(Pixel) + sizeof(std::uint32_t));
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  pixels_ = rounded_pixels(width, height);
  locks_ = std::make_unique<Stripe[]>(std::size_t(stripes_));
  for (std::unique_ptr<Pixel[]>& half : halves_) half = std::make_unique_for_overwrite<Pixel[]>(pixels);
  for (std::unique_ptr<std::uint64_t[]>& half : directions_) {
    if (directions) half = std::make_unique_for_overwrite<std::uint64_t[]>(pixels);
  }
  static_assert(kDirectionBytes == 2 * sizeof(directions_[0][0]));
  invalid_ = std::make_unique_for_overwrite<std::uint32_t[]>(pixels);
}

SplatBuffer::~SplatBuffer() = default;

void SplatBuffer::clear() {
  ++era_;
  for (std::atomic<std::uint64_t>& paths : light_paths_) paths = 0;
  invalid_outside_ = 0;
  any_invalid_ = false;
}

std::size_t SplatBuffer::bytes() const {
  const std::size_t per_pixel = kBytesPerPixel + (directions_[0] ? kDirectionBytes : 0);
  return std::size_t(width_) * std::size_t(height_) * per_pixel + std::size_t(stripes_) * sizeof(Stripe);
}

// Its lock is held.
void SplatBuffer::prepare(int stripe) {
  Stripe& lock = locks_[std::size_t(stripe)];
  if (holds_anything(lock)) return;
  const std::size_t begin = index(0, stripe * kStripeRows);
  const std::size_t end = index(0, std::min((stripe + 1) * kStripeRows, height_));
  for (std::unique_ptr<Pixel[]>& half : halves_) std::fill(&half[begin], &half[begin] + (end - begin), Pixel{});
  for (std::unique_ptr<std::uint64_t[]>& half : directions_) {
    if (half) std::fill(&half[begin], &half[begin] + (end - begin), kNoDirection);
  }
  std::fill(&invalid_[begin], &invalid_[begin] + (end - begin), 0u);
  lock.era = era_;
}

void SplatBuffer::prepare_rows(int y0, int y1) {
  for (int stripe = y0 / kStripeRows; stripe * kStripeRows < y1; ++stripe) {
    const std::lock_guard lock(locks_[std::size_t(stripe)].mutex);
    prepare(stripe);
  }
}

std::uint8_t* SplatBuffer::sums(int half) {
  return reinterpret_cast<std::uint8_t*>(halves_[half].get());
}

SplatBuffer::Totals SplatBuffer::totals() const {
  return {{light_paths(0), light_paths(1)}, invalid_outside(), any_invalid_.load(std::memory_order_relaxed)};
}

void SplatBuffer::set_totals(const Totals& totals) {
  for (int half = 0; half < 2; ++half) light_paths_[half] = totals.light_paths[half];
  invalid_outside_ = totals.invalid_outside;
  any_invalid_ = totals.any_invalid;
}

double SplatBuffer::most_radiance(int width, int height) {
  return kLargest * rounded_pixels(width, height);
}

bool SplatBuffer::takes(const Splat& splat) const {
  const auto fits = [&](float value) { return std::abs(double(value)) <= kLargest * pixels_; };
  return is_inside(splat) && fits(splat.radiance.x) && fits(splat.radiance.y) && fits(splat.radiance.z);
}

// The lock of its stripe is held. False: invalid.
bool SplatBuffer::add(int half, const Splat& splat) {
  if (!takes(splat)) return false;
  double value[3];
  for (int c = 0; c < 3; ++c) value[c] = double(splat.radiance[c]) / pixels_;
  Pixel& pixel = halves_[half][index(splat.x, splat.y)];
  for (int c = 0; c < 3; ++c) {
    pixel.sum[c] += to_fixed(value[c]);
    add_saturated(pixel.squares[c], to_fixed_square(value[c]));
  }
  if (directions_[half]) {
    std::uint64_t& first = directions_[half][index(splat.x, splat.y)];
    first = std::min(first, ring(splat, half));
  }
  return true;
}

std::uint64_t SplatBuffer::add(int half, std::span<const Splat> splats, std::uint64_t light_paths) {
  // Splats by stripe, so that each lock is taken once.
  thread_local std::vector<std::uint32_t> ends, order;
  ends.assign(std::size_t(stripes_) + 1, 0);
  order.resize(splats.size());
  std::uint64_t outside = 0, invalid = 0;
  for (const Splat& splat : splats) {
    if (is_inside(splat)) {
      ++ends[std::size_t(splat.y / kStripeRows) + 1];
    } else {
      ++outside;
    }
  }
  for (std::size_t s = 1; s < ends.size(); ++s) ends[s] += ends[s - 1];
  // ends[s] is where stripe s begins, and moves to where it ends.
  for (std::size_t i = 0; i < splats.size(); ++i) {
    if (is_inside(splats[i])) order[ends[std::size_t(splats[i].y / kStripeRows)]++] = std::uint32_t(i);
  }
  const auto fetch = [&](std::uint32_t i) {
    const Splat& splat = splats[order[i]];
    const char* pixel = reinterpret_cast<const char*>(&halves_[half][index(splat.x, splat.y)]);
    for (const std::size_t at : {std::size_t(0), sizeof(Pixel) / 2, sizeof(Pixel) - 1})
      __builtin_prefetch(pixel + at, 1);
  };
  const std::uint32_t inside = ends[std::size_t(stripes_)];
  for (std::uint32_t i = 0; i < std::min(inside, kFetchedAhead); ++i) fetch(i);
  std::uint32_t next = 0;
  for (int stripe = 0; stripe < stripes_; ++stripe) {
    const std::uint32_t end = ends[std::size_t(stripe)];
    if (next == end) continue;
    const std::lock_guard lock(locks_[std::size_t(stripe)].mutex);
    prepare(stripe);
    for (; next < end; ++next) {
      if (next + kFetchedAhead < inside) fetch(next + kFetchedAhead);
      const Splat& splat = splats[order[next]];
      if (add(half, splat)) continue;
      ++invalid_[index(splat.x, splat.y)];
      ++invalid;
      any_invalid_.store(true, std::memory_order_relaxed);
    }
  }
  if (outside > 0) invalid_outside_.fetch_add(outside, std::memory_order_relaxed);
  light_paths_[half].fetch_add(light_paths, std::memory_order_relaxed);
  return outside + invalid;
}

void SplatBuffer::read_row(int half, int y, int x0, int x1, double* means, double* variances) const {
  const std::size_t values = 4 * std::size_t(x1 - x0);
  const double n = double(light_paths(half));
  const Stripe& stripe = locks_[std::size_t(y / kStripeRows)];
  const std::lock_guard lock(stripe.mutex);
  if (!holds_anything(stripe) || n == 0) {
    std::fill_n(means, values, 0.0);
    if (variances) std::fill_n(variances, values, 0.0);
    return;
  }
  const double unit = kQuantum * pixels_, square_unit = kSquareQuantum * pixels_ * pixels_;
  const Pixel* row = &halves_[half][index(0, y)];
  for (int x = x0; x < x1; ++x, means += 4) {
    for (int c = 0; c < 3; ++c) means[c] = double(row[x].sum[c]) * unit / n;
    means[3] = 0;
    if (!variances) continue;
    for (int c = 0; c < 3; ++c) {
      const double off = double(row[x].squares[c]) * square_unit - means[c] * means[c] * n;
      variances[c] = n > 1 ? std::max(0.0, off) / (n * (n - 1)) : 0;
    }
    variances[3] = 0;
    variances += 4;
  }
}

Rgb SplatBuffer::mean(int half, int x, int y) const {
  double value[4];
  read_row(half, y, x, x + 1, value);
  Rgb mean;
  for (int c = 0; c < 3; ++c) mean[c] = float(std::clamp(value[c], -double(FLT_MAX), double(FLT_MAX)));
  return mean;
}

ToldLight SplatBuffer::told(int half, int x, int y) const {
  if (!directions_[half]) return {};
  const Stripe& stripe = locks_[std::size_t(y / kStripeRows)];
  const std::lock_guard lock(stripe.mutex);
  const std::uint64_t first = holds_anything(stripe) ? directions_[half][index(x, y)] : kNoDirection;
  if (first == kNoDirection) return {};
  return {std::uint32_t(first & ((1u << kDirectionBits) - 1)), unpack_share(std::uint32_t(first >> kDirectionBits))};
}

double SplatBuffer::brightest(int y, int x0, int x1) const {
  const Stripe& stripe = locks_[std::size_t(y / kStripeRows)];
  const std::lock_guard lock(stripe.mutex);
  if (!holds_anything(stripe)) return 0;
  double brightest = 0;
  for (const std::unique_ptr<Pixel[]>& half : halves_) {
    const Pixel* row = &half[index(0, y)];
    for (int x = x0; x < x1; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double sum = double(row[x].sum[c]) * kQuantum, squares = double(row[x].squares[c]) * kSquareQuantum;
        // No splat is above the sum, though squares, which are rounded up, may say so of the smallest.
        if (sum > 0) brightest = std::max(brightest, std::min(squares / sum, sum));
      }
    }
  }
  return brightest * pixels_;
}

std::uint64_t SplatBuffer::invalid_in(const PixelRect& window) const {
  std::uint64_t total = 0;
  if (!any_invalid_.load(std::memory_order_relaxed)) return total;
  for (int y = window.y0; y < window.y1; ++y) {
    const Stripe& stripe = locks_[std::size_t(y / kStripeRows)];
    const std::lock_guard lock(stripe.mutex);
    if (!holds_anything(stripe)) continue;
    for (int x = window.x0; x < window.x1; ++x) total += invalid_[index(x, y)];
  }
  return total;
}

bool SplatBuffer::operator==(const SplatBuffer& other) const {
  if (width_ != other.width_ || height_ != other.height_ || invalid_outside() != other.invalid_outside()) return false;
  for (int half = 0; half < 2; ++half) {
    if (light_paths(half) != other.light_paths(half)) return false;
  }
  const Pixel nothing{};
  for (int y = 0; y < height_; ++y) {
    const auto s = std::size_t(y / kStripeRows);
    const bool here = holds_anything(locks_[s]), there = other.holds_anything(other.locks_[s]);
    for (std::size_t i = index(0, y); i < index(0, y + 1); ++i) {
      for (int half = 0; half < 2; ++half) {
        const Pixel &a = here ? halves_[half][i] : nothing, &b = there ? other.halves_[half][i] : nothing;
        if (!(a == b)) return false;
        if (!directions_[half] || !other.directions_[half]) continue;
        if ((here ? directions_[half][i] : kNoDirection) != (there ? other.directions_[half][i] : kNoDirection))
          return false;
      }
      if ((here ? invalid_[i] : 0) != (there ? other.invalid_[i] : 0)) return false;
    }
  }
  return true;
}

}  // namespace helio
