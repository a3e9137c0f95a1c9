// Writes that fail at each step of a kept job's life: a disk that is full, and folders that turn read-only.
#include <sched.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <filesystem>

#include "kept_jobs_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples

// While it lives no file of this process grows beyond 1 KiB, as on a disk that is full: each write to the database, its
// log, a checkpoint or a picture fails.
class FullDisk {
 public:
  FullDisk() : handler_(signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(getrlimit(RLIMIT_FSIZE, &before_), 0);
    rlimit limited = before_;
    limited.rlim_cur = 1 << 10;
    EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }

 private:
  void (*const handler_)(int);
  rlimit before_{};
};

class DiskTrouble : public KeptJobsTest {
 protected:
  std::string undisturbed(const pb::SubmitJobRequest& asked) {
    const std::string id = submitted(asked);
    const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
    return result(id);
  }
  bool has_checkpoint(const std::string& id) const {
    const std::string stem = folder_ / ("state/checkpoints/" + id);
    return fs::exists(stem + ".a") || fs::exists(stem + ".b");
  }
};

TEST_F(DiskTrouble, AFullDiskIsToldAtEachStepAndLosesNothing) {
  start_daemon([](ServerConfig& config) { config.checkpoint_interval_s = 0.01; });
  spdlog::set_level(spdlog::level::off);
  const std::string scene = load_scene();
  const auto with_an_end = request(scene, 48, 2048);
  const std::string expected = undisturbed(with_an_end);
  const std::string running = submitted(request(scene, 48, kNoEnd));
  wait_for_samples(running, 2);
  const std::string ending = submitted(with_an_end);
  wait_for_samples(ending, 1);
  pb::SubmitJobResponse refused;
  {
    const FullDisk disk;
    // A caller is told which file, and that it is no fault of the request.
    expect_status(submit(request(scene, 48, 4), &refused), StatusCode::UNAVAILABLE, {"jobs.sqlite"});
    expect_status(pause(running), StatusCode::UNAVAILABLE, {"jobs.sqlite"});
    expect_status(cancel(running), StatusCode::UNAVAILABLE, {"jobs.sqlite"});
    EXPECT_EQ(job(running).state(), pb::JOB_STATE_RUNNING) << "it renders on";
    // Its picture comes to its end, and neither picture nor row can be written.
    EXPECT_TRUE(eventually([&] { return !job(ending).has_progress(); }));
    EXPECT_EQ(job(ending).state(), pb::JOB_STATE_RUNNING) << "what the disk took last";
  }
  // Room again: the job says what happened, and goes on.
  pb::Job told = wait_for(ending, pb::JOB_STATE_PAUSED);
  if (told.state() == pb::JOB_STATE_PAUSED) {
    EXPECT_NE(told.reason().find("could not be written"), std::string::npos) << told.reason();
    ASSERT_TRUE(resume(ending).ok());
    told = wait_for(ending, pb::JOB_STATE_SUCCEEDED);
  }
  EXPECT_EQ(told.state(), pb::JOB_STATE_SUCCEEDED) << told.reason();
  EXPECT_TRUE(result(ending) == expected) << "the bits are others";
  ASSERT_TRUE(pause(running).ok());
  const pb::Job paused = wait_for(running, pb::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.state(), pb::JOB_STATE_PAUSED) << paused.reason();
  EXPECT_TRUE(has_checkpoint(running));
  EXPECT_TRUE(cancel(running).ok());
  EXPECT_FALSE(has_checkpoint(running));
  EXPECT_TRUE(undisturbed(with_an_end) == expected);
}

// As when somebody has removed their folder.
TEST_F(DiskTrouble, CheckpointsThatCannotBeWrittenAreToldAndTheJobGoesOn) {
  start_daemon([](ServerConfig& config) { config.checkpoint_interval_s = 0.01; });
  spdlog::set_level(spdlog::level::off);
  const std::string scene = load_scene();
  const std::string expected = undisturbed(request(scene, 48, 512));
  const std::string folder = folder_ / "state/checkpoints", away = folder_ / "state/away";
  fs::rename(folder, away);
  const std::string id = submitted(request(scene, 48, 512));
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_NE(done.reason().find("a checkpoint was not written"), std::string::npos) << done.reason();
  EXPECT_TRUE(result(id) == expected);
  fs::rename(away, folder);
}

// The folders of the state folder turn read-only beneath a daemon, as a file system does after an error.
TEST_F(DiskTrouble, FoldersThatTurnReadOnlyPauseTheJobs) {
  // Mounts are this thread's alone, and those of the threads that it starts from here on.
  if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
    GTEST_SKIP() << "skipped: file systems may not be mounted";
  start_daemon([](ServerConfig& config) { config.checkpoint_interval_s = 0.01; });
  spdlog::set_level(spdlog::level::off);
  const std::string scene = load_scene();
  const std::string expected = undisturbed(request(scene, 48, 64));
  const std::string id = submitted(request(scene, 48, 4096));
  wait_for_samples(id, 1);
  const std::vector<std::string> covered = {folder_ / "state/checkpoints", folder_ / "state/results"};
  for (const std::string& folder : covered) {
    if (mount("tmpfs", folder.c_str(), "tmpfs", MS_RDONLY, "size=4k") != 0)
      GTEST_SKIP() << "skipped: file systems may not be mounted";
  }
  const pb::Job paused = wait_for(id, pb::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.state(), pb::JOB_STATE_PAUSED) << "done before the folder was read-only: " << paused.reason();
  EXPECT_NE(paused.reason().find("could not be written"), std::string::npos) << paused.reason();
  EXPECT_NE(paused.reason().find("Read-only file system"), std::string::npos) << paused.reason();
  for (const std::string& folder : covered) EXPECT_EQ(umount(folder.c_str()), 0);
  ASSERT_TRUE(resume(id).ok());
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_TRUE(undisturbed(request(scene, 48, 64)) == expected);
}

}  // namespace
}  // namespace helio::test
