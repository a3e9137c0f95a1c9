// Test data that lies beside the repository, never in it.
//
//   HELIO_SHARED_OR_SKIP(root, "scenes/images-malformed");   // first line of a test; declares std::filesystem::path
//   root
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace helio::test {

// ../shared, or what the environment variable HELIO_SHARED names.
inline std::filesystem::path shared_root() {
  const char* override_path = std::getenv("HELIO_SHARED");
  if (override_path && *override_path) return override_path;
  return std::filesystem::path(HELIO_SOURCE_DIR).parent_path() / "shared";
}

// In continuous integration the data must be there: its absence is a failure, not a skip.
inline bool shared_required() {
  const char* ci = std::getenv("CI");
  return ci && std::string(ci) == "true";
}

inline std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace helio::test

#define HELIO_SHARED_OR_SKIP(variable, relative)                                          \
  const std::filesystem::path variable = ::helio::test::shared_root() / (relative);       \
  if (!std::filesystem::exists(variable)) {                                               \
    if (::helio::test::shared_required()) FAIL() << variable << " is absent and CI=true"; \
    GTEST_SKIP() << "skipped: " << variable << " is absent";                              \
  }                                                                                       \
  static_assert(true, "")
