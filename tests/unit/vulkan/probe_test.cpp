// Listing devices by a program that may crash, hang or say anything, and the cache of what its self-tests found.
#include "renderer/vulkan/probe/probe.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/vulkan/probe/device_json.h"
#include "renderer/vulkan/probe/driver_files.h"
#include "tests/unit/picture/temporary_folder.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;
using vulkan::DeviceInfo;
using vulkan::DeviceList;
using vulkan::Level;

class Probe : public ::testing::Test {
 protected:
  Probe() { options_.time_limit = std::chrono::seconds(30); }  // for machines that are busy

  // Stands in for heliograph-vulkan-probe.
  void answer_by(const std::string& script) {
    const fs::path program = folder_.path() / "probe";
    std::ofstream(program) << "#!/bin/sh\n" << script;
    fs::permissions(program, fs::perms::owner_all);
    options_.program = program;
  }
  // A line that lists devices of these levels.
  static std::string listing(const std::vector<Level>& levels) {
    nlohmann::json list = nlohmann::json::array();
    for (const Level level : levels) {
      DeviceInfo device;
      device.index = int(list.size());
      device.name = "device " + std::to_string(list.size());
      device.device_uuid = std::to_string(list.size());
      device.level = level;
      if (level != Level::rt) device.reason = "the driver lacks something";
      list.push_back(to_json(device));
    }
    return "echo '" + nlohmann::json{{"devices", list}}.dump() + "'\n";
  }
  DeviceList probe() const {
    DeviceList found = probe_devices(options_);
    // Nothing is left of the program.
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
    return found;
  }

  TemporaryFolder folder_;
  vulkan::ProbeOptions options_{{}, folder_.path() / "cache"};
};

const std::string kPass = R"(echo '{"begin": []}'; echo '{"outcome": ""}'
)";
const std::string kCrash = R"(echo '{"begin": []}'; kill -SEGV $$
)";

TEST_F(Probe, SaysThatTheProgramIsMissing) {
  options_.program = folder_.path() / "nothing";
  const DeviceList found = probe();
  EXPECT_TRUE(found.devices.empty());
  EXPECT_EQ(found.reason, options_.program.string() + " does not start: No such file or directory");
}

TEST_F(Probe, SaysWhyThereAreNoDevices) {
  answer_by(R"(echo '{"error": "there is no Vulkan loader"}')");
  EXPECT_EQ(probe().reason, "there is no Vulkan loader");
  answer_by(R"(echo '{"devices": []}')");
  EXPECT_EQ(probe().reason, "the Vulkan drivers find no device");
}

TEST_F(Probe, OutlivesACrashWhileDriversStart) {
  answer_by("kill -SEGV $$");
  const DeviceList found = probe();
  EXPECT_TRUE(found.devices.empty());
  EXPECT_EQ(found.reason, "the probe of Vulkan devices crashed (SIGSEGV)");
  answer_by("exit 3");
  EXPECT_EQ(probe().reason, "the probe of Vulkan devices ended with exit code 3");
  answer_by("exit 0");
  EXPECT_EQ(probe().reason, "the probe of Vulkan devices ended without an answer");
}

TEST_F(Probe, EndsAProgramThatHangs) {
  answer_by("exec sleep 60");
  options_.time_limit = std::chrono::milliseconds(300);
  const double begin = now_s();
  const DeviceList found = probe();
  EXPECT_GE(now_s() - begin, 0.3);
  EXPECT_EQ(found.reason, "the drivers gave no answer within 300 ms");
  answer_by("exec <&- >&-; exec sleep 60");  // it closes its output and stays
  EXPECT_EQ(probe().reason, "the probe of Vulkan devices was killed: it did not end in time");
}

TEST_F(Probe, RefusesWhatItDoesNotUnderstand) {
  const std::vector<std::string> answers = {"echo rubbish",
                                            "echo '[]'",
                                            "echo '{\"devices\": [{}]}'",
                                            "echo '{\"devices\": 7}'",
                                            "printf '\\377\\000\\n'",
                                            "head -c 3000000 /dev/zero"};
  for (const std::string& answer : answers) {
    answer_by(answer);
    const DeviceList found = probe();
    EXPECT_TRUE(found.devices.empty());
    EXPECT_EQ(found.reason, "heliograph-vulkan-probe answers what is not understood; is it of another version?")
        << answer;
  }
}

TEST_F(Probe, LevelsAreThoseThatPassTheirTests) {
  answer_by(listing({Level::rt, Level::compute, Level::none}) + "read request\n" + kPass + kPass + kPass);
  const DeviceList found = probe();
  ASSERT_EQ(found.devices.size(), 3u) << found.reason;
  EXPECT_EQ(found.devices[0].level, Level::rt);
  EXPECT_EQ(found.devices[0].reason, "");
  EXPECT_EQ(found.devices[1].level, Level::compute);
  EXPECT_EQ(found.devices[1].reason, "the driver lacks something");
  EXPECT_EQ(found.devices[2].level, Level::none);
}

TEST_F(Probe, AWrongAnswerCostsTheLevel) {
  answer_by(listing({Level::rt}) + "read request\n" + kPass +
            R"(echo '{"begin": []}'; echo '{"outcome": "ray (1, 2) hit triangle 3"}')");
  const DeviceList found = probe();
  ASSERT_EQ(found.devices.size(), 1u) << found.reason;
  EXPECT_EQ(found.devices[0].level, Level::compute);
  EXPECT_EQ(found.devices[0].reason, "the self-test of rt failed: ray (1, 2) hit triangle 3");
}

// The first device crashes in its test of compute; the program starts again for what was not tested.
TEST_F(Probe, ACrashIsTheDevicesAlone) {
  answer_by(listing({Level::rt, Level::compute}) + "read request\necho \"$request\" >> '" +
            (folder_.path() / "requests").string() + "'\ncase \"$request\" in *'[0,\"compute\"]'*) " + kCrash +
            ";; esac\n" + kPass + kPass);
  const DeviceList found = probe();
  ASSERT_EQ(found.devices.size(), 2u) << found.reason;
  EXPECT_EQ(found.devices[0].level, Level::none);
  EXPECT_EQ(found.devices[0].reason, "the self-test of compute failed: the driver crashed (SIGSEGV)");
  EXPECT_EQ(found.devices[1].level, Level::compute);
  std::ifstream requests(folder_.path() / "requests");
  std::string first, second, third;
  std::getline(requests, first);
  std::getline(requests, second);
  EXPECT_EQ(first, R"({"test":[[0,"compute"],[1,"compute"],[0,"rt"]]})");
  EXPECT_EQ(second, R"({"test":[[1,"compute"],[0,"rt"]]})");
  EXPECT_FALSE(std::getline(requests, third));

  // Both results are known from then on.
  answer_by(listing({Level::rt, Level::compute}) + "read request\n" + kCrash);
  const DeviceList again = probe();
  ASSERT_EQ(again.devices.size(), 2u) << again.reason;
  EXPECT_EQ(again.devices[0].reason, found.devices[0].reason);
  EXPECT_EQ(again.devices[1].level, Level::compute);
}

TEST_F(Probe, TestsThatHangCostTheLevelAndAreNotCached) {
  answer_by(listing({Level::rt}) + "read request\n" + kPass + "exec sleep 60\n");
  options_.time_limit = std::chrono::milliseconds(400);
  const DeviceList found = probe();
  ASSERT_EQ(found.devices.size(), 1u) << found.reason;
  EXPECT_EQ(found.devices[0].level, Level::compute);
  EXPECT_EQ(found.devices[0].reason, "the self-test of rt failed: no answer within 400 ms");
  answer_by(listing({Level::rt}) + "read request\n" + kPass);
  options_.time_limit = std::chrono::seconds(30);
  EXPECT_EQ(probe().devices.at(0).level, Level::rt);
}

TEST_F(Probe, WorksWithoutACache) {
  std::ofstream(folder_.path() / "cache") << "a file where the folder should be";
  answer_by(listing({Level::compute}) + "read request\n" + kPass);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(probe().devices.at(0).level, Level::compute);
}

TEST_F(Probe, ADamagedCacheIsNone) {
  fs::create_directories(folder_.path() / "cache");
  for (const char* text : {"", "[]", "{\"a\": ", "{\"a\": 7}", "\xff\xfe"}) {
    std::ofstream(folder_.path() / "cache/vulkan-self-tests.json") << text;
    answer_by(listing({Level::compute}) + "read request\n" + kPass);
    EXPECT_EQ(probe().devices.at(0).level, Level::compute) << text;
    answer_by(listing({Level::compute}));  // no test is asked for
    EXPECT_EQ(probe().devices.at(0).level, Level::compute) << text;
  }
}

// Sets a variable of the environment for as long as it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST_F(Probe, AnotherDriverFileIsAnotherResult) {
  const fs::path manifest = folder_.path() / "driver.json", library = folder_.path() / "libdriver.so";
  std::ofstream(manifest) << R"({"ICD": {"library_path": "./libdriver.so", "api_version": "1.3.0"}})";
  std::ofstream(library) << "code";
  const Variable files("VK_DRIVER_FILES", manifest.string());
  ASSERT_EQ(vulkan::driver_files().size(), 2u);

  answer_by(listing({Level::compute}) + "read request\n" + kPass);
  EXPECT_EQ(probe().devices.at(0).level, Level::compute);
  const std::string crashing = listing({Level::compute}) + "read request\n" + kCrash;
  answer_by(crashing);
  EXPECT_EQ(probe().devices.at(0).level, Level::compute);  // as cached
  for (const fs::path& file : {manifest, library}) {
    const auto time = fs::last_write_time(file);
    fs::last_write_time(file, time + std::chrono::seconds(1));
    EXPECT_EQ(probe().devices.at(0).level, Level::none) << file;
    fs::last_write_time(file, time);
    EXPECT_EQ(probe().devices.at(0).level, Level::compute) << file;
  }
  std::ofstream(library, std::ios::app) << " of another size";
  EXPECT_EQ(probe().devices.at(0).level, Level::none);
}

TEST_F(Probe, AnswersOnAThread) {
  answer_by("sleep 1\n" + listing({Level::none}));
  const vulkan::DeviceProbe later(options_);
  EXPECT_FALSE(later.finished());
  EXPECT_EQ(later.devices().devices.size(), 1u);
  EXPECT_TRUE(later.finished());
}

// A machine may be too busy for the first time limit.
TEST_F(Probe, DriversThatAreLateGetAnotherChance) {
  const std::string seen = "'" + (folder_.path() / "seen").string() + "'";
  answer_by("if [ ! -e " + seen + " ]; then touch " + seen + "; exec sleep 60; fi\n" + listing({Level::none}));
  options_.time_limit = std::chrono::seconds(3);
  const vulkan::DeviceProbe probe(options_);
  const DeviceList first = probe.devices();
  EXPECT_TRUE(first.late);
  EXPECT_EQ(first.devices.size(), 0u);
  for (int i = 0; i < 20000 && probe.devices().late; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(probe.devices().devices.size(), 1u);
}

TEST_F(Probe, NobodyWaitsForADriverThatIsGivenUp) {
  answer_by("exec sleep 600\n");
  options_.time_limit = std::chrono::milliseconds(100);
  options_.patience = std::chrono::hours(1);
  const vulkan::DeviceProbe probe(options_);
  EXPECT_TRUE(probe.devices().late);
}  // ends the second probe

class ProbeOfThisMachine : public DeviceTest {};

TEST_F(ProbeOfThisMachine, ConfirmsWhatTheDriversPromise) {
  const TemporaryFolder folder;
  vulkan::ProbeOptions options;
  options.cache_folder = folder.path();
  options.time_limit = std::chrono::seconds(60);  // under sanitizers, and on machines that are busy
  const double begin = now_s();
  const DeviceList found = probe_devices(options);
  const double first_s = now_s() - begin;
  ASSERT_GT(found.devices.size(), std::size_t(device()->info().index)) << found.reason;
  const DeviceInfo& info = found.devices[std::size_t(device()->info().index)];
  EXPECT_EQ(to_json(info), to_json(device()->info()));
  const DeviceList again = probe_devices(options);
  ASSERT_EQ(again.devices.size(), found.devices.size()) << again.reason;
  for (std::size_t i = 0; i < found.devices.size(); ++i)
    EXPECT_EQ(to_json(again.devices[i]), to_json(found.devices[i]));
  RecordProperty("first_ms", int(1e3 * first_s));
}

}  // namespace
}  // namespace helio::test
