#include "client/report/pictures/rgbe_bytes.h"

#include <algorithm>
#include <cmath>

namespace helio::report {
namespace {

constexpr int kBias = 136;               // 128, and 8 bits of mantissa
constexpr float kLargest = 0x1.fcp126f;  // its exponent fits a byte, and its mantissa still rounds to 254

float shown(float value) {
  return value > 0 ? std::min(value, kLargest) : 0;
}

}  // namespace

std::vector<std::uint8_t> rgbe_planes(const PictureView& picture) {
  const std::size_t pixels = picture.pixels(), width = std::size_t(picture.width);
  std::vector<std::uint8_t> planes(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float rgb[3] = {shown(picture.channels[0][i]), shown(picture.channels[1][i]), shown(picture.channels[2][i])};
    const float largest = std::max({rgb[0], rgb[1], rgb[2]});
    int exponent = 0;
    std::frexp(largest, &exponent);  // largest < 2^exponent
    if (largest > 0 && std::lround(std::ldexp(largest, 8 - exponent)) == 256) ++exponent;
    const int stored = exponent + kBias - 8;
    if (largest == 0 || stored < 1) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      planes[c * pixels + i] = std::uint8_t(std::lround(std::ldexp(rgb[c], 8 - exponent)));
    }
    planes[3 * pixels + i] = std::uint8_t(stored);
  }
  for (std::size_t row = 0; row < planes.size(); row += width) {
    for (std::size_t i = width - 1; i > 0; --i) planes[row + i] = std::uint8_t(planes[row + i] - planes[row + i - 1]);
  }
  return planes;
}

}  // namespace helio::report
