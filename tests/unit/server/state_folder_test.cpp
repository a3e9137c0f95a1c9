#include "server/state/state_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>

#include "state_process.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

// Sets a variable of the environment, or removes it, until it goes.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    if (const char* before = getenv(name)) before_ = before;
    set(value);
  }
  ~Environment() { set(before_ ? before_->c_str() : nullptr); }

 private:
  void set(const char* value) { value == nullptr ? unsetenv(name_) : setenv(name_, value, 1); }
  const char* name_;
  std::optional<std::string> before_;
};

TEST(StateFolder, TheDefaultIsBesideThePersonsData) {
  const Environment home("HOME", "/home/ann");
  {
    const Environment state("XDG_STATE_HOME", "/data/state");
    EXPECT_EQ(*default_state_folder(), "/data/state/heliograph");
  }
  {
    const Environment state("XDG_STATE_HOME", "relative");  // which the specification says to ignore
    EXPECT_EQ(*default_state_folder(), "/home/ann/.local/state/heliograph");
  }
  const Environment state("XDG_STATE_HOME", nullptr), nowhere("HOME", nullptr);
  EXPECT_NE(default_state_folder().error().to_string().find("$XDG_STATE_HOME nor $HOME"), std::string::npos);
}

TEST(StateFolder, IsMadeForItsOwnerAlone) {
  TemporaryFolder folder;
  const auto opened = StateFolder::open(folder / "a/b/");
  ASSERT_TRUE(opened) << opened.error().to_string();
  EXPECT_EQ(opened->path(), folder / "a/b");
  for (const std::string& path : {opened->path(), opened->checkpoints(), opened->scenes(), opened->results()}) {
    struct stat info {};
    ASSERT_EQ(stat(path.c_str(), &info), 0) << path;
    EXPECT_EQ(info.st_mode & 0777, 0700u) << path;
  }
  EXPECT_EQ(opened->jobs_file(), folder / "a/b/jobs.sqlite");
}

TEST(StateFolder, IsOneDaemonsAtATime) {
  TemporaryFolder folder;
  const std::string path = folder / "state";
  Process other(this_program(), {"lock", path}, folder.path());
  ASSERT_TRUE(other.wait_for_output("held\n")) << other.output();
  std::string process = read_file(path + "/lock");
  process.pop_back();  // line end
  const auto refused = StateFolder::open(path);
  ASSERT_FALSE(refused);
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::failed_precondition));
  EXPECT_EQ(refused.error().to_string(), "the state folder '" + path + "' is in use by process " + process +
                                             "; a daemon needs a state folder of its own");
  EXPECT_EQ(read_file(path + "/lock"), process + "\n") << "who was refused has written";
  EXPECT_EQ(kill(pid_t(std::stoi(process)), 0), 0) << "the process is not the one that holds it";
  other.send_signal(SIGKILL);
  other.wait();
  EXPECT_TRUE(StateFolder::open(path));  // and gives it back
  auto again = StateFolder::open(path);
  ASSERT_TRUE(again);
  StateFolder moved = std::move(*again);
  EXPECT_FALSE(StateFolder::open(path));
}

TEST(StateFolder, SaysWhyItCannotBeMade) {
  TemporaryFolder folder;
  write_file(folder / "file", "");
  const auto file = StateFolder::open(folder / "file");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().to_string(), "the state folder '" + (folder / "file") + "' is not a folder");
  const auto below = StateFolder::open(folder / "file/state");
  ASSERT_FALSE(below);
  EXPECT_NE(below.error().to_string().find("the state folder '" + (folder / "file/state") + "' cannot be made: Not a"),
            std::string::npos)
      << below.error().to_string();
  EXPECT_FALSE(StateFolder::open(""));
}

TEST(StateFolder, OneThatCannotBeWrittenIsRefused) {
  TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::all);
  const std::string path = folder / "state";
  ASSERT_TRUE(StateFolder::open(path));
  fs::permissions(path, fs::perms(0555));
  fs::permissions(path + "/lock", fs::perms(0444));
  const ProcessResult result = run_program(this_program(), {"nobody", path}, folder.path());
  if (result.out == "not permitted\n") GTEST_SKIP() << "skipped: no other user may be taken";
  EXPECT_EQ(result.out, "the state folder '" + path + "' cannot be written: Permission denied\n") << result.err;
}

}  // namespace
}  // namespace helio::test
