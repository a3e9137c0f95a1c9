#include "renderer/codec/srgb_bytes.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "renderer/base/srgb.h"

namespace helio {
namespace {

// Buckets of floats share sign, exponent and the first seven bits of the mantissa. Below the first one the byte is 0.
constexpr int kShift = 16;
constexpr float kFirst = 0x1p-13f;  // 255 * 12.92 * 2^-13 < 0.5
constexpr std::uint32_t kFirstBucket = std::bit_cast<std::uint32_t>(kFirst) >> kShift;
constexpr std::uint32_t kBuckets = (std::bit_cast<std::uint32_t>(1.0f) >> kShift) - kFirstBucket;

std::uint8_t exact_byte(float linear) {
  return std::uint8_t(std::lround(255.0f * encode_srgb(linear)));
}

struct Table {
  std::array<float, 257> least;  // the smallest float of each byte; the last: none
  std::array<std::uint8_t, kBuckets> byte;  // of the smallest float of each bucket

  Table() {
    least[0] = 0;
    least[256] = std::numeric_limits<float>::infinity();
    for (int b = 1; b < 256; ++b) {
      std::uint32_t low = 0, high = std::bit_cast<std::uint32_t>(1.0f);  // byte below b | at least b
      while (high - low > 1) {
        const std::uint32_t middle = low + (high - low) / 2;
        (exact_byte(std::bit_cast<float>(middle)) < b ? low : high) = middle;
      }
      least[std::size_t(b)] = std::bit_cast<float>(high);
    }
    for (std::uint32_t i = 0; i < kBuckets; ++i) {
      byte[i] = exact_byte(std::bit_cast<float>((kFirstBucket + i) << kShift));
    }
  }
};

const Table& table() {
  static const Table made;
  return made;
}

std::uint8_t look_up(const Table& table, float linear) {
  if (!(linear >= kFirst)) return 0;  // NaN, too
  if (linear >= 1.0f) return 255;
  // A bucket has one step of the byte at most: it is 1/128 of the value wide, and 255 * 1.055 / 2.4 / 128 < 1.
  const std::uint8_t byte = table.byte[(std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirstBucket];
  return std::uint8_t(byte + (linear >= table.least[byte + 1u]));
}

}  // namespace

std::uint8_t srgb_byte(float linear) {
  return look_up(table(), linear);
}

void srgb_bytes(const float* values, std::size_t count, double factor, std::uint8_t* out, std::size_t stride) {
  const Table& bytes = table();
  for (std::size_t i = 0; i < count; ++i) out[stride * i] = look_up(bytes, float(factor * values[i]));
}

}  // namespace helio
