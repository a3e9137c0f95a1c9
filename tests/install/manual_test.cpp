// Manuals, example configuration and example program, as they are installed, and what is said of this machine.
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "cli_test.h"
#include "daemon_process.h"
#include "renderer/codec/tile_codec.h"
#include "server/base/server_config.h"
#include "tests/support/shared_data.h"

namespace helio::test {
namespace {

// "--name" of every option that the help lists at the start of a line.
std::set<std::string> options_in(const std::string& help) {
  static const std::regex kOption(R"(\n  (?:-\w,)?(--[a-z][a-z-]*))");
  std::set<std::string> names;
  for (std::sregex_iterator match(help.begin(), help.end(), kOption), end; match != end; ++match) {
    names.insert((*match)[1]);
  }
  return names;
}

std::vector<std::string> commands_in(const std::string& help) {
  std::vector<std::string> names;
  std::size_t at = help.find("\nSubcommands:\n");
  if (at == std::string::npos) return names;
  std::istringstream lines(help.substr(at + 14));
  for (std::string line; std::getline(lines, line) && line.rfind("  ", 0) == 0;) {
    names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

// The part of a page about a command: from its heading to the next.
std::string section_of(const std::string& page, const std::string& heading) {
  const std::size_t begin = page.find("\n" + heading + "\n");
  if (begin == std::string::npos) return {};
  return page.substr(begin, page.find("\n.S", begin + 1) - begin);
}

std::string in_roff(const std::string& name) {
  return std::regex_replace(name, std::regex("-"), "\\-");
}

class Manual : public CliTest {
 protected:
  // Every option of `help` is in `section`, and every command of it has a section of its own that is whole.
  void expect_whole(const std::string& page, const std::string& section, std::vector<std::string> command) {
    std::vector<std::string> asked = command;
    asked.push_back("--help");
    const std::string help = "\n" + heliograph(asked).out;
    const std::set<std::string> options = options_in(help);
    EXPECT_TRUE(options.count("--help")) << help;
    for (const std::string& option : options) {
      EXPECT_NE(section.find(in_roff(option)), std::string::npos) << option << " of " << command.size();
    }
    for (const std::string& name : commands_in(help)) {
      std::string heading = "heliograph";
      for (const std::string& word : command) heading += " " + word;
      const std::string inner = section_of(page, ".SS \"" + heading + " " + name + "\"");
      EXPECT_NE(inner, "") << heading << " " << name;
      ++commands_;
      if (name == "serve") continue;  // its options are those of heliographd(8)
      std::vector<std::string> path = command;
      path.push_back(name);
      expect_whole(page, inner, path);
    }
  }

  void expect_no_warnings(const std::string& page) {
    const std::string groff = "/usr/bin/groff";
    if (!std::filesystem::exists(groff)) {
      if (shared_required()) FAIL() << groff << " is not installed and CI=true";
      GTEST_SKIP() << "skipped: " << groff << " is not installed";
    }
    write_file(folder_ / "page", page);
    const ProcessResult result = run_program(groff, {"-man", "-ww", "-z", "-Tutf8", "page"}, folder_.path());
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
  }

  int commands_ = 0;
};

TEST_F(Manual, OfTheCommandHoldsEveryCommandAndOption) {
  const std::string page = heliograph({"--man"}).out;
  expect_whole(page, section_of(page, ".SH OPTIONS"), {});
  EXPECT_GE(commands_, 9);
  EXPECT_NE(page.find("\n.SH EXIT STATUS\n"), std::string::npos);
  expect_no_warnings(page);
}

TEST_F(Manual, OfTheDaemonHoldsEveryOption) {
  const ProcessResult result = run_program(HELIO_DAEMON, {"--man"}, folder_.path());
  EXPECT_EQ(result.exit_code, 0);
  for (const ConfigOption& option : config_options()) {
    EXPECT_NE(result.out.find(in_roff("--" + option.name)), std::string::npos) << option.name;
  }
  EXPECT_NE(result.out.find("HELIOGRAPH_MAX_MEMORY"), std::string::npos);
  expect_no_warnings(result.out);
}

// Each line that sets a default is read, and sets what is the default already.
TEST_F(Manual, TheExampleConfigurationIsRead) {
  std::string example = run_program(HELIO_DAEMON, {"--example-config"}, folder_.path()).out;
  EXPECT_EQ(example, example_config());
  example = std::regex_replace(example, std::regex("\n#([a-z])"), "\n$1");
  static const std::regex kFiles(
      "\n(scene-root|output-root|port-file|oidn-library|token-file|http-host|tls-certificate|tls-key|tls-client-ca) "
      "=(?=\n)");
  example = std::regex_replace(example, kFiles, "\n$1 = there");
  example = std::regex_replace(example, std::regex("\nhttp =(?=\n)"), "\nhttp = 127.0.0.1:0");
  write_file(folder_ / "example.conf", example);
  const auto request = parse_server_config("heliographd", {"--config", folder_ / "example.conf"});
  ASSERT_TRUE(request.ok()) << request.error().to_string();
  EXPECT_EQ(request->config.listen, "127.0.0.1:50051");
  for (const ConfigOption& option : config_options()) {
    EXPECT_NE(example.find("\n" + option.name + " = "), std::string::npos) << option.name;
    static const std::set<std::string> kSet{"listen",          "http",    "port-file",    "oidn-library", "token-file",
                                            "tls-certificate", "tls-key", "tls-client-ca"};
    if (kSet.contains(option.name)) continue;
    EXPECT_EQ(option.get(request->config), option.get(daemon_defaults())) << option.name;
  }
}

using Example = CliTest;

TEST_F(Example, RendersAFrameOnADaemon) {
  DaemonProcess daemon({"--render-threads", "1"});
  const ProcessResult result =
      run_program(HELIO_EXAMPLE_CLIENT, {daemon.address(), folder_ / "quad.gltf", "frame.exr"}, folder_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto frame = read_exr(folder_ / "frame.exr", 1 << 24);
  ASSERT_TRUE(frame.ok()) << frame.error().to_string();
  EXPECT_EQ(frame->find("samples")->front(), 16);
}

using Isa = CliTest;

TEST_F(Isa, InfoTellsTheMachineAndThePathThatRuns) {
  const auto json = heliograph_json({"info"});
  const auto& machine = json["machine"];
  EXPECT_EQ(json["isa"],
            machine["compiled_for"].get<std::string>() + ", traversal by " + machine["traversal"].get<std::string>());
  // Compiler, build type and the linker's build id.
  EXPECT_TRUE(std::regex_match(json["build"].get<std::string>(), std::regex(".+, .+, [0-9a-f]{10}"))) << json["build"];
  EXPECT_GT(machine["threads"], 0);
  EXPECT_NE(machine["libraries"]["Embree"], "");
  const std::string device = json["devices"][0]["name"];
  EXPECT_NE(device.find("traversal by " + machine["traversal"].get<std::string>()), std::string::npos) << device;
  EXPECT_NE(heliograph({"info"}).out.find("processor: "), std::string::npos);
}

TEST_F(Isa, IsTheOneAskedFor) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "one instruction set";
#endif
  EXPECT_EQ(heliograph_json({"info", "--isa", "sse4.2"})["machine"]["traversal"], "sse4.2");
  EXPECT_EQ(heliograph_json({"info", "--isa", "sse2"})["machine"]["traversal"], "sse2");
  const auto automatic = heliograph_json({"info", "--isa", "auto"})["machine"];
  EXPECT_EQ(automatic["traversal"], automatic["instruction_sets"].back());
}

TEST_F(Isa, ThatIsNoneIsRefused) {
  const ProcessResult unknown = heliograph({"info", "--isa", "mmx"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("--isa: 'mmx'; allowed: auto, sse2"), std::string::npos) << unknown.err;
  const ProcessResult remote = heliograph({"info", "--isa", "sse2", "--server", "127.0.0.1:1"});
  EXPECT_NE(remote.err.find("--isa: does not go with --server"), std::string::npos) << remote.err;
  EXPECT_NE(run_program(HELIO_DAEMON, {"--isa", "mmx"}, folder_.path()).err.find("--isa: 'mmx'"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
