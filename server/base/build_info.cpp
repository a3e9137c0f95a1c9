#include "server/base/build_info.h"

namespace helio {

const char* build_version() {
  return HELIO_VERSION;
}

const char* build_description() {
#if defined(__clang__)
  return "clang " __clang_version__ ", " HELIO_BUILD_TYPE;
#else
  return "g++ " __VERSION__ ", " HELIO_BUILD_TYPE;
#endif
}

const char* build_isa() {
#if defined(__AVX512F__)
  return "avx512";
#elif defined(__AVX2__)
  return "avx2";
#elif defined(__AVX__)
  return "avx";
#elif defined(__SSE2__)
  return "sse2";
#elif defined(__ARM_NEON)
  return "neon";
#else
  return "generic";
#endif
}

const char* build_embree() {
  return "Embree " HELIO_EMBREE_VERSION;
}

}  // namespace helio
