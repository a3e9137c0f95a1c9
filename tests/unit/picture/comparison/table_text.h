// Units of several modes, and the sentences of their table.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "renderer/comparison/comparison_table.h"

namespace helio::test {

inline std::vector<ComparedUnit> together(std::vector<ComparedUnit> a, const std::vector<ComparedUnit>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// All sentences, one a line.
inline std::string all(const ComparisonTable& table) {
  std::string text;
  for (const std::string& sentence : table.sentences) text += sentence + "\n";
  return text;
}

}  // namespace helio::test

#define EXPECT_SAYS(table, part) \
  EXPECT_NE(helio::test::all(table).find(part), std::string::npos) << helio::test::all(table)
#define EXPECT_SAYS_NOTHING_OF(table, part) \
  EXPECT_EQ(helio::test::all(table).find(part), std::string::npos) << helio::test::all(table)
