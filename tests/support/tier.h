// How thorough the running test is. `./check` runs the short tier in minutes; `./check --full` sets HELIO_TEST_TIER=full,
// in which statistical tests take the samples that their full claim needs.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string_view>

namespace helio::test {

inline bool full_tier() {
  static const bool full = [] {
    const char* tier = std::getenv("HELIO_TEST_TIER");
    return tier != nullptr && std::string_view(tier) == "full";
  }();
  return full;
}

// The size of a test (seeds, samples, moves) in the tier that runs.
template <class T>
T by_tier(T short_tier, T full) {
  return full_tier() ? full : short_tier;
}

}  // namespace helio::test

// Leaves the rest of a test to the full tier.
#define HELIO_FULL_TIER_ONLY() \
  if (!::helio::test::full_tier()) GTEST_SKIP() << "only in ./check --full"
