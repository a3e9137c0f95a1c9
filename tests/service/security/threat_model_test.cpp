// The table of server/README.md, "Threat model": every line names tests, and these are there.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "process.h"

namespace helio::test {
namespace {

// "Suite.Name" of every test of GoogleTest below tests/, and "file.py" of every file of tests in Python.
std::set<std::string> all_tests() {
  std::set<std::string> names;
  static const std::regex kTest(R"(\nTEST(?:_F|_P)?\((\w+),\s*(\w+)\))");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(std::string(HELIO_SOURCE_DIR) + "/tests")) {
    if (entry.path().extension() == ".py") names.insert(entry.path().filename().string());
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = "\n" + read_file(entry.path().string());
    for (std::sregex_iterator match(text.begin(), text.end(), kTest), end; match != end; ++match)
      names.insert((*match)[1].str() + "." + (*match)[2].str());
  }
  return names;
}

TEST(ThreatModel, HasATestForEachOfItsLines) {
  const std::set<std::string> tests = all_tests();
  ASSERT_TRUE(tests.contains("ThreatModel.HasATestForEachOfItsLines"));
  const std::string page = read_file(std::string(HELIO_SOURCE_DIR) + "/server/README.md");
  const std::size_t begin = page.find("\n### Threat model\n");
  ASSERT_NE(begin, std::string::npos);
  std::istringstream lines(page.substr(begin, page.find("\n#", begin + 5) - begin));
  static const std::regex kRow(R"(\| (.+) \| (.+) \| (.+) \|)"), kName("`([^`]+)`");
  int rows = 0;
  for (std::string line; std::getline(lines, line);) {
    std::smatch row;
    if (!std::regex_match(line, row, kRow) || row[1] == "what an attacker does" || row[1].str().starts_with("-"))
      continue;
    ++rows;
    const std::string named = row[3];
    int found = 0;
    for (std::sregex_iterator match(named.begin(), named.end(), kName), end; match != end; ++match, ++found)
      EXPECT_TRUE(tests.contains((*match)[1])) << (*match)[1] << " of: " << line;
    EXPECT_GT(found, 0) << line;
  }
  EXPECT_GE(rows, 15);
}

}  // namespace
}  // namespace helio::test
