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

std::vector<std::pair<std::string, std::string>> build_libraries() {
  return {{"Embree", HELIO_EMBREE_VERSION}, {"OpenEXR", HELIO_OPENEXR_VERSION}, {"OpenImageIO", HELIO_OIIO_VERSION},
          {"TBB", HELIO_TBB_VERSION},       {"gRPC", HELIO_GRPC_VERSION},       {"Protobuf", HELIO_PROTOBUF_VERSION}};
}

}  // namespace helio
