// heliograph token: what it makes is what a daemon takes.
#include <signal.h>
#include <sys/stat.h>

#include "cli_test.h"
#include "daemon_process.h"
#include "server/base/access_tokens.h"

namespace helio::test {
namespace {

using TokenCommand = CliTest;

TEST_F(TokenCommand, MakesALineThatTheDaemonTakes) {
  const ProcessResult made = heliograph({"token", "alice", "--role", "view", "--output", "alice.token"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  EXPECT_EQ(made.out.rfind("alice view sha256:", 0), 0u) << made.out;
  struct stat info {};
  ASSERT_EQ(stat((folder_ / "alice.token").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  const std::string token = read_file(folder_ / "alice.token");
  EXPECT_EQ(token.size(), 33u);
  EXPECT_EQ(made.out.find(token.substr(0, 32)), std::string::npos) << "shows the token";

  const auto bob = heliograph_json({"token", "bob", "--sessions", "2", "--jobs", "3", "--memory", "1G"});
  EXPECT_EQ(bob["role"], "render");
  EXPECT_NE(bob["line"].get<std::string>().find(" sessions=2 jobs=3 memory=1073741824"), std::string::npos) << bob;
  write_file(folder_ / "tokens", made.out + bob["line"].get<std::string>() + "\n");
  write_file(folder_ / "bob.token", bob["token"].get<std::string>() + "\n");
  DaemonProcess daemon({"--token-file", folder_ / "tokens", "--log-level", "off"});
  const auto run = [&](std::vector<std::string> words, const std::string& who) {
    words.insert(words.end(), {"--server", daemon.address(), "--token-file", who + ".token"});
    return heliograph(words);
  };
  EXPECT_EQ(run({"info"}, "alice").exit_code, 0);
  const std::vector<std::string> render = {"render", "quad.gltf", "--samples", "1", "--size", "8x8"};
  const ProcessResult refused = run(render, "alice");
  EXPECT_EQ(refused.exit_code, 3);  // its scene is refused
  expect_one_line(refused.err);
  EXPECT_NE(refused.err.find("the token 'alice' has the role view; LoadScene needs render"), std::string::npos)
      << refused.err;
  const ProcessResult rendered = run(render, "bob");
  EXPECT_EQ(rendered.exit_code, 0) << rendered.err;
  // A daemon's file is no client's.
  const ProcessResult wrong = heliograph({"info", "--server", daemon.address(), "--token-file", "tokens"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("holds no token but what a daemon knows of one"), std::string::npos) << wrong.err;

  // Taken out of the file, bob is a stranger.
  write_file(folder_ / "tokens", made.out);
  daemon.signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return run({"info"}, "bob").exit_code == 1; }));
  EXPECT_EQ(run({"info"}, "alice").exit_code, 0);
}

TEST_F(TokenCommand, ShowsTheTokenOnStderrAndNamesWhatIsWrong) {
  const ProcessResult made = heliograph({"token", "alice"});
  ASSERT_EQ(made.exit_code, 0);
  ASSERT_EQ(made.err.size(), 33u) << made.err;
  write_file(folder_ / "tokens", made.out);
  const auto tokens = AccessTokens::read(folder_ / "tokens");
  ASSERT_TRUE(tokens.ok()) << tokens.error().to_string();
  ASSERT_NE(tokens->find(made.err.substr(0, 32)), nullptr);
  EXPECT_EQ(tokens->find(made.err.substr(0, 32))->name, "alice");

  const ProcessResult wrong = heliograph({"token", "a b", "--role", "king", "--jobs", "-1", "--memory", "much"});
  EXPECT_EQ(wrong.exit_code, 2);
  expect_one_line(wrong.err);
  for (const char* part :
       {"NAME: 'a b'", "--role: 'king' is none of view, render, admin", "--jobs", "--memory: 'much'"})
    EXPECT_NE(wrong.err.find(part), std::string::npos) << part << ": " << wrong.err;
  EXPECT_EQ(heliograph({"token"}).exit_code, 2);
  EXPECT_EQ(heliograph({"token", "bob", "--output", "/dev/null"}).exit_code, 2);
  // A token that is there cannot be found again.
  const ProcessResult kept = heliograph({"token", "bob", "--output", folder_ / "mine"});
  EXPECT_EQ(kept.exit_code, 0) << kept.err;
  const std::string token = read_file(folder_ / "mine");
  EXPECT_NE(heliograph({"token", "bob", "--output", folder_ / "mine"}).exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "mine"), token);
  EXPECT_EQ(heliograph({"token", "unnamed-3"}).exit_code, 2);
}

}  // namespace
}  // namespace helio::test
