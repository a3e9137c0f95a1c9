// heliograph view: what it prints, who gets in, how it ends.
#include <signal.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "cli_test.h"
#include "daemon_process.h"
#include "heliograph/v1/web.pb.h"
#include "service_fixture.h"
#include "web/web_peer.h"

namespace helio::test {
namespace {

class CliView : public CliTest {
 protected:
  struct Address {
    std::string host, scene, token;
  };
  // Of "http://HOST:PORT/#id=SCENE&scene=PATH&token=TOKEN".
  static Address parse(const std::string& text) {
    std::smatch parts;
    static const std::regex kUrl("http://([^/]+)/#id=([0-9a-f]{64})(?:&scene=[^&]+)?(?:&token=([0-9a-f]{32}))?");
    if (!std::regex_search(text, parts, kUrl)) return {};
    return {parts[1], parts[2], parts[3]};
  }

  // Whether the page of this address lets the token in.
  static bool gets_in(const std::string& host, const std::string& token) {
    WebPeer peer(host);
    EXPECT_EQ(peer.upgrade().status, 101);
    heliograph::v1::WebRequest hello;
    hello.mutable_hello()->set_envelope(1);
    hello.mutable_hello()->set_token(token);
    peer.send_message(hello.SerializeAsString());
    const auto frame = peer.read_frame();
    return frame && frame->opcode == 2;
  }
};

TEST_F(CliView, ServesThePageUntilItIsInterrupted) {
  Process view(HELIOGRAPH_PROGRAM, {"view", folder_ / "quad.gltf", "--http", "127.0.0.1:0", "--no-browser"},
               folder_.path());
  ASSERT_TRUE(view.wait_for_output("Ctrl-C ends")) << view.errors();
  const Address address = parse(view.output());
  ASSERT_FALSE(address.host.empty()) << view.output();
  EXPECT_NE(view.output().find("&scene=quad.gltf&"), std::string::npos) << "by which a link opens it again";
  EXPECT_EQ(WebPeer(address.host).get("/").status, 200);
  EXPECT_TRUE(gets_in(address.host, address.token));
  EXPECT_FALSE(gets_in(address.host, ""));
  EXPECT_FALSE(gets_in(address.host, std::string(32, '0')));
  view.send_signal(SIGINT);
  const ProcessResult result = view.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(CliView, TakesTheNextPortAndSaysSo) {
  Process first(HELIOGRAPH_PROGRAM, {"view", folder_ / "quad.gltf", "--http", "127.0.0.1:0", "--json"}, folder_.path());
  ASSERT_TRUE(first.wait_for_output("}"));
  const std::string host = parse(nlohmann::json::parse(first.output())["url"]).host;
  TemporaryFolder other;
  Process second(HELIOGRAPH_PROGRAM, {"view", folder_ / "quad.gltf", "--http", host, "--no-browser"}, other.path());
  ASSERT_TRUE(second.wait_for_output("Ctrl-C ends")) << second.errors();
  EXPECT_NE(second.output().find("is in use"), std::string::npos) << second.output();
  EXPECT_NE(parse(second.output()).host, host);
}

TEST_F(CliView, ShowsWhatADaemonHas) {
  write_file(folder_ / "tokens", "0123456789abcdef\n");
  DaemonProcess silent({}), serving({"--http", "127.0.0.1:0", "--token-file", folder_ / "tokens"});
  const auto view = [&](const DaemonProcess& daemon, std::vector<std::string> more) {
    std::vector<std::string> arguments{"view", folder_ / "quad.gltf", "--server", daemon.address(), "--no-browser"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(HELIOGRAPH_PROGRAM, arguments, folder_.path());
  };
  const ProcessResult none = view(silent, {});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("--http HOST:PORT"), std::string::npos) << none.err;
  const ProcessResult stranger = view(serving, {});
  EXPECT_EQ(stranger.exit_code, 1);
  EXPECT_NE(stranger.err.find("names no token"), std::string::npos) << stranger.err;
  const ProcessResult shown = view(serving, {"--token-file", folder_ / "tokens"});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.out.find("&token=0123456789abcdef"), std::string::npos) << shown.out;
}

TEST_F(CliView, NamesWhatIsWrong) {
  const auto view = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"view"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(HELIOGRAPH_PROGRAM, arguments, folder_.path());
  };
  EXPECT_EQ(view({"missing.gltf", "--http", "127.0.0.1:0"}).exit_code, 3);
  const ProcessResult bad = view({folder_ / "quad.gltf", "--http", "nowhere", "--token-file", "none"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.err.find("--http"), std::string::npos) << bad.err;
  EXPECT_NE(bad.err.find("--token-file"), std::string::npos) << bad.err;
  const ProcessResult server = view({folder_ / "quad.gltf", "--server", "127.0.0.1:1", "--http", "127.0.0.1:0"});
  EXPECT_EQ(server.exit_code, 2);
}

}  // namespace
}  // namespace helio::test
