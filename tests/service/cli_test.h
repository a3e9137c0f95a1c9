// The real `heliograph` program in a folder of its own, beside a small scene.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "process.h"
#include "service_fixture.h"

namespace helio::test {

class CliTest : public testing::Test {
 protected:
  void SetUp() override { write_file(folder_ / "quad.gltf", quad_gltf(2)); }

  ProcessResult heliograph(const std::vector<std::string>& arguments) {
    return run_program(HELIOGRAPH_PROGRAM, arguments, folder_.path());
  }
  // Runs with --json and parses stdout, which must hold nothing else.
  nlohmann::json heliograph_json(std::vector<std::string> arguments, int exit_code = 0) {
    arguments.push_back("--json");
    const ProcessResult result = heliograph(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    if (exit_code == 0) {
      EXPECT_EQ(result.err, "");
    }
    nlohmann::json json = nlohmann::json::parse(result.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << result.out;
    return json;
  }
  bool exists(const std::string& name) { return !read_file(folder_ / name).empty(); }

  TemporaryFolder folder_;
};

// "heliograph: ..." in exactly one line.
inline void expect_one_line(const std::string& err) {
  EXPECT_EQ(err.rfind("heliograph: ", 0), 0u) << err;
  EXPECT_EQ(err.find('\n'), err.size() - 1) << err;
}

}  // namespace helio::test
