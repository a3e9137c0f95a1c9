// Open Image Denoise for tests: the real library, where the machine has it, and a fake one (fake_oidn.cpp) everywhere,
// for the sources that CMake's helio_fake_oidn() names.
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

// Tells the fake library what to do, for as long as this lives: words of fake_oidn.cpp.
class FakeOidnDoes {
 public:
  explicit FakeOidnDoes(const std::string& words) { setenv("HELIO_FAKE_OIDN", words.c_str(), 1); }
  ~FakeOidnDoes() { unsetenv("HELIO_FAKE_OIDN"); }
  FakeOidnDoes(const FakeOidnDoes&) = delete;
  FakeOidnDoes& operator=(const FakeOidnDoes&) = delete;
};

}  // namespace helio::test

// Leaves the rest of a test to the full tier of machines that have the library.
#define HELIO_NEEDS_OIDN()                \
  HELIO_FULL_TIER_ONLY();                 \
  if (::helio::test::oidn_path().empty()) \
  GTEST_SKIP() << "HELIOGRAPH_OIDN names no libOpenImageDenoise.so (tests/README.md)"
