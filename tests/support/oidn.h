// Open Image Denoise, where the machine that tests has it.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/support/tier.h"

namespace helio::test {

// The library that HELIOGRAPH_OIDN names; empty: none.
inline std::string oidn_path() {
  const char* path = std::getenv("HELIOGRAPH_OIDN");
  return path ? path : "";
}

}  // namespace helio::test

// Leaves the rest of a test to the full tier of machines that have the library.
#define HELIO_NEEDS_OIDN()                \
  HELIO_FULL_TIER_ONLY();                 \
  if (::helio::test::oidn_path().empty()) \
  GTEST_SKIP() << "HELIOGRAPH_OIDN names no libOpenImageDenoise.so (tests/README.md)"
