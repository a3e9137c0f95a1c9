#include "renderer/base/processor_features.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace helio {

#if defined(__x86_64__)

namespace {

struct Registers {
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
};

Registers cpuid(unsigned leaf) {
  Registers r;
  __get_cpuid_count(leaf, 0, &r.eax, &r.ebx, &r.ecx, &r.edx);
  return r;
}

// Which registers the kernel saves: bits 1 and 2 for AVX, 5 to 7 besides for AVX-512 (Intel SDM 1, 13.3).
unsigned enabled_state() {
  unsigned low, high;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

uint32_t bit_if(bool present, uint32_t feature) {
  return present ? feature : 0;
}

}  // namespace

uint32_t present_features() {
  const Registers basic = cpuid(1), extended = cpuid(7), amd = cpuid(0x80000001);
  const unsigned state = basic.ecx & bit_OSXSAVE ? enabled_state() : 0;
  const bool avx = (state & 0x06) == 0x06, avx512 = (state & 0xe6) == 0xe6;
  return bit_if(basic.ecx & bit_SSE4_2, kFeatureSse42) | bit_if(basic.ecx & bit_POPCNT, kFeaturePopcnt) |
         bit_if(basic.ecx & bit_MOVBE, kFeatureMovbe) | bit_if(amd.ecx & bit_LZCNT, kFeatureLzcnt) |
         bit_if(extended.ebx & bit_BMI, kFeatureBmi) | bit_if(extended.ebx & bit_BMI2, kFeatureBmi2) |
         bit_if(avx && (basic.ecx & bit_F16C), kFeatureF16c) | bit_if(avx && (basic.ecx & bit_FMA), kFeatureFma) |
         bit_if(avx && (basic.ecx & bit_AVX), kFeatureAvx) | bit_if(avx && (extended.ebx & bit_AVX2), kFeatureAvx2) |
         bit_if(avx512 && (extended.ebx & bit_AVX512F), kFeatureAvx512f) |
         bit_if(avx512 && (extended.ebx & bit_AVX512BW), kFeatureAvx512bw) |
         bit_if(avx512 && (extended.ebx & bit_AVX512CD), kFeatureAvx512cd) |
         bit_if(avx512 && (extended.ebx & bit_AVX512DQ), kFeatureAvx512dq) |
         bit_if(avx512 && (extended.ebx & bit_AVX512VL), kFeatureAvx512vl);
}

#else

uint32_t present_features() {
  return ~uint32_t(0);
}

#endif

}  // namespace helio
