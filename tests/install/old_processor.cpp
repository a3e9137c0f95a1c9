// A program of a build that needs AVX2 and FMA, on a processor that has nothing.
#include <cstdio>

#include "renderer/base/processor_features.h"

namespace helio {

extern constexpr uint32_t kRequiredFeatures = kFeatureAvx2 | kFeatureFma;

uint32_t present_features() {
  return 0;
}

}  // namespace helio

namespace {

struct Initialiser {
  Initialiser() { std::puts("an initialiser ran"); }
} initialiser;

}  // namespace

int main() {
  std::puts("main ran");
}
