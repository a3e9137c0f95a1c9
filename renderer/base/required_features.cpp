// Compiled as all other code is, so that the compiler's macros tell the features that it may use.
#include "renderer/base/processor_features.h"

namespace helio {

extern constexpr uint32_t kRequiredFeatures = 0
#ifdef __SSE4_2__
                                              | kFeatureSse42
#endif
#ifdef __POPCNT__
                                              | kFeaturePopcnt
#endif
#ifdef __MOVBE__
                                              | kFeatureMovbe
#endif
#ifdef __LZCNT__
                                              | kFeatureLzcnt
#endif
#ifdef __BMI__
                                              | kFeatureBmi
#endif
#ifdef __BMI2__
                                              | kFeatureBmi2
#endif
#ifdef __F16C__
                                              | kFeatureF16c
#endif
#ifdef __FMA__
                                              | kFeatureFma
#endif
#ifdef __AVX__
                                              | kFeatureAvx
#endif
#ifdef __AVX2__
                                              | kFeatureAvx2
#endif
#ifdef __AVX512F__
                                              | kFeatureAvx512f
#endif
#ifdef __AVX512BW__
                                              | kFeatureAvx512bw
#endif
#ifdef __AVX512CD__
                                              | kFeatureAvx512cd
#endif
#ifdef __AVX512DQ__
                                              | kFeatureAvx512dq
#endif
#ifdef __AVX512VL__
                                              | kFeatureAvx512vl
#endif
    ;

}  // namespace helio
