#include "renderer/codec/half_convert.h"

#include <half.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#if defined(__AVX__) && defined(__F16C__)
#include <immintrin.h>
#endif

namespace helio {
namespace {

constexpr float kLargestHalf = 65504.0f;
constexpr float kSmallestHalf = 0x1p-24f;

float prepare(float x, bool keep_positive) {
  if (x > kLargestHalf) return kLargestHalf;  // false for NaN
  if (x < -kLargestHalf) return -kLargestHalf;
  return keep_positive && x > 0 && x < kSmallestHalf ? kSmallestHalf : x;
}

}  // namespace

void convert_to_half(const float* in, std::size_t count, bool keep_positive, char* out) {
  std::size_t i = 0;
#if defined(__AVX__) && defined(__F16C__)
  const __m256 largest = _mm256_set1_ps(kLargestHalf), lowest = _mm256_set1_ps(-kLargestHalf);
  const __m256 zero = _mm256_setzero_ps(), smallest = _mm256_set1_ps(keep_positive ? kSmallestHalf : 0.0f);
  for (; i + 8 <= count; i += 8) {
    __m256 x = _mm256_loadu_ps(in + i);
    x = _mm256_max_ps(lowest, _mm256_min_ps(largest, x));  // the second operand wins when it is NaN
    const __m256 positive = _mm256_cmp_ps(x, zero, _CMP_GT_OQ);
    x = _mm256_blendv_ps(x, _mm256_max_ps(smallest, x), positive);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + 2 * i), _mm256_cvtps_ph(x, _MM_FROUND_TO_NEAREST_INT));
  }
#endif
  for (; i < count; ++i) {
    const std::uint16_t bits = half(prepare(in[i], keep_positive)).bits();
    std::memcpy(out + 2 * i, &bits, sizeof(bits));
  }
}

}  // namespace helio
