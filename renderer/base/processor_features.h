// The processor's features that code may be compiled for, as bits. C alone: this is used before anything else runs.
#pragma once

#include <stdint.h>

namespace helio {

enum ProcessorFeature : uint32_t {
  kFeatureSse42 = 1u << 0,
  kFeaturePopcnt = 1u << 1,
  kFeatureMovbe = 1u << 2,
  kFeatureLzcnt = 1u << 3,
  kFeatureBmi = 1u << 4,
  kFeatureBmi2 = 1u << 5,
  kFeatureF16c = 1u << 6,
  kFeatureFma = 1u << 7,
  kFeatureAvx = 1u << 8,
  kFeatureAvx2 = 1u << 9,
  kFeatureAvx512f = 1u << 10,
  kFeatureAvx512bw = 1u << 11,
  kFeatureAvx512cd = 1u << 12,
  kFeatureAvx512dq = 1u << 13,
  kFeatureAvx512vl = 1u << 14,
};

// Those that this build was compiled for (HELIO_ARCH). A constant: no code of that build runs to make it.
extern const uint32_t kRequiredFeatures;

// Those that this machine's processor has and its kernel has enabled.
uint32_t present_features();

}  // namespace helio
