// Ctrl-C, and a daemon that dies: what was rendered is kept.
#include <signal.h>

#include "cli_test.h"
#include "daemon_process.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

class CliInterrupt : public CliTest {
 protected:
  // Starts a command and waits until its progress line holds the text.
  std::unique_ptr<Process> start(std::vector<std::string> arguments, const std::string& progress = "samples/s") {
    arguments.insert(arguments.end(), {"--progress", "always"});
    auto process = std::make_unique<Process>(HELIOGRAPH_PROGRAM, arguments, folder_.path());
    EXPECT_TRUE(process->wait_for_errors(progress)) << process->errors();
    return process;
  }

  // The file shows the square, and as many samples as reported.
  void expect_partial_picture(const std::string& name, const nlohmann::json& json) {
    const auto picture = read_exr(folder_ / name, 1 << 20);
    ASSERT_TRUE(picture) << picture.error().to_string();
    EXPECT_EQ((*picture->find("R"))[32 * 64 + 32], 2);
    EXPECT_EQ((*picture->find("samples"))[32 * 64 + 32], json["samples"].get<float>());
    EXPECT_GT(json["samples"], 0);
  }

  const std::vector<std::string> endless_ = {"render",    "quad.gltf",  "--environment", "0,0,0", "--size", "64x64",
                                             "--samples", "1000000000", "--output",      "q.exr", "--json"};
};

TEST_F(CliInterrupt, CtrlCKeepsThePicture) {
  const auto process = start(endless_);
  process->send_signal(SIGINT);
  const ProcessResult result = process->wait(20);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_NE(result.err.find("interrupted; the picture so far"), std::string::npos) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["partial"], true);
  EXPECT_EQ(json["ended_by"], "cancelled");
  expect_partial_picture("q.exr", json);
}

TEST_F(CliInterrupt, CtrlCCancelsTheDaemonsJob) {
  const DaemonProcess daemon({"--render-threads", "1", "--max-jobs", "1"});
  auto arguments = endless_;
  arguments.insert(arguments.end(), {"--server", daemon.address()});
  const auto process = start(arguments);
  process->send_signal(SIGTERM);
  EXPECT_EQ(process->wait(20).exit_code, 143);
  // The only job slot is free again.
  heliograph_json({"render", "quad.gltf", "--size", "8x8", "--samples", "1", "--server", daemon.address()});
}

TEST_F(CliInterrupt, AKilledDaemonIsOneLineAndLeavesThePicture) {
  DaemonProcess daemon({"--render-threads", "1"});
  auto arguments = endless_;
  arguments.insert(arguments.end(), {"--server", daemon.address()});
  const auto process = start(arguments);
  daemon.signal(SIGKILL);
  const ProcessResult result = process->wait(20);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("heliograph: the server at " + daemon.address() + " is not available"), std::string::npos)
      << result.err;
  expect_partial_picture("q.exr", nlohmann::json::parse(result.out));
}

TEST_F(CliInterrupt, AKilledDaemonLeavesTheViewsSoFar) {
  write_file(folder_ / "path.json", R"({"views": [{"samples": 2}, {"samples": 1000000000}]})");
  DaemonProcess daemon({"--render-threads", "1"});
  const auto process = start({"move", "quad.gltf", "--environment", "0,0,0", "--mode", "pt", "--size", "64x64",
                              "--path", "path.json", "--output", "v.#.exr", "--json", "--server", daemon.address()},
                             "view 1: ");
  daemon.signal(SIGKILL);
  const ProcessResult result = process->wait(20);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json["frames"].size(), 2u);
  EXPECT_EQ(json["frames"][0]["partial"], false);
  EXPECT_EQ(json["frames"][1]["partial"], true);
  expect_partial_picture("v.0.exr", json["frames"][0]);
  expect_partial_picture("v.1.exr", json["frames"][1]);
}

TEST_F(CliInterrupt, CtrlCStopsAMove) {
  const auto process =
      start({"move", "quad.gltf", "--size", "64x64", "--turn", "10", "--samples", "1000000000", "--output", "v.#.exr"},
            "view 0: ");
  process->send_signal(SIGINT);
  const ProcessResult result = process->wait(20);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_NE(result.err.find("interrupted; 1 of 3 pictures"), std::string::npos) << result.err;
  EXPECT_TRUE(exists("v.0.exr"));
}

}  // namespace
}  // namespace helio::test
