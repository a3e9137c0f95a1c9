// `heliograph health`, as probes of containers call it.
#include <signal.h>

#include "../cli_test.h"
#include "../daemon_process.h"

namespace helio::test {
namespace {

using CliHealth = CliTest;

TEST_F(CliHealth, TellsWhoServes) {
  DaemonProcess daemon({"--log-level", "off"});
  ASSERT_FALSE(daemon.address().empty());
  for (const std::string service : {"", "heliograph.v1.RenderService"}) {
    std::vector<std::string> words = {"health", "--server", daemon.address()};
    if (!service.empty()) words.insert(words.end(), {"--service", service});
    const ProcessResult result = heliograph(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, (service.empty() ? "the daemon" : service) + " at " + daemon.address() + " serves\n");
    const auto json = heliograph_json(words);
    EXPECT_EQ(json["server"], daemon.address());
    EXPECT_EQ(json["service"], service);
    EXPECT_EQ(json["serving"], true);
  }
  const ProcessResult unknown = heliograph({"health", "--server", daemon.address(), "--service", "no.Such"});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.err.find("--service: 'no.Such'"), std::string::npos) << unknown.err;
  expect_one_line(unknown.err);
}

// A job that is run holds the daemon while it drains.
TEST_F(CliHealth, ADaemonThatDrainsDoesNotServe) {
  DaemonProcess daemon({"--log-level", "off", "--drain-grace", "3600"});
  ASSERT_FALSE(daemon.address().empty());
  Process job(HELIOGRAPH_PROGRAM,
              {"render", "quad.gltf", "--server", daemon.address(), "--time", "3600", "--output", "x.exr", "--json"},
              folder_.path());
  const auto runs = [&] {
    const auto scenes = heliograph_json({"info", "--server", daemon.address()})["scenes"];
    return !scenes.empty() && scenes[0]["references"] > 0;
  };
  ASSERT_TRUE(eventually(runs));
  daemon.signal(SIGTERM);
  const std::vector<std::string> words = {"health", "--server", daemon.address()};
  ASSERT_TRUE(eventually([&] { return heliograph(words).exit_code != 0; }));
  const ProcessResult result = heliograph(words);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "heliograph: the daemon at " + daemon.address() +
                            " does not serve: it drains, or is not ready\n");
  const auto json = heliograph_json(words, 1);
  EXPECT_EQ(json["serving"], false);
  EXPECT_EQ(json["exit_code"], 1);
  job.send_signal(SIGKILL);
}

// A token is no secret between a daemon and its probes.
TEST_F(CliHealth, NeedsNoToken) {
  write_file(folder_ / "tokens", "0123456789abcdef0123456789abcdef\n");
  DaemonProcess daemon({"--log-level", "off", "--token-file", folder_ / "tokens"});
  ASSERT_FALSE(daemon.address().empty());
  EXPECT_EQ(heliograph({"health", "--server", daemon.address()}).exit_code, 0);
  EXPECT_NE(heliograph({"info", "--server", daemon.address()}).exit_code, 0);
}

TEST_F(CliHealth, NamesBadOptions) {
  const ProcessResult nobody = heliograph({"health", "--server", "127.0.0.1:1"});
  EXPECT_EQ(nobody.exit_code, 4);
  EXPECT_NE(nobody.err.find("no server answers at 127.0.0.1:1"), std::string::npos) << nobody.err;
  const ProcessResult wrong =
      heliograph({"health", "--server", "127.0.0.1:1", "--timeout", "0", "--service", std::string(300, 's')});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("--timeout: '0'"), std::string::npos) << wrong.err;
  EXPECT_NE(wrong.err.find("--service: 300 bytes; allowed: at most 256"), std::string::npos) << wrong.err;
  const ProcessResult missing = heliograph({"health"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("--server: is missing"), std::string::npos) << missing.err;
}

}  // namespace
}  // namespace helio::test
