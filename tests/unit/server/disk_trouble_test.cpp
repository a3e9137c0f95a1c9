// A disk that is full, and a database that another program has locked.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "server/state/checkpoint_files.h"
#include "server/state/job_table.h"
#include "server/state/state_folder.h"
#include "state_process.h"

namespace helio::test {

// On a file system of 4 MiB. Ends at once when something is other than expected.
void small_disk(const std::string& folder) {
  const std::string path = folder + "/state", ballast = folder + "/ballast";
  {
    auto state = StateFolder::open(path);
    std::vector<std::string> notices;
    auto table = state ? JobTable::open(state->jobs_file(), notices) : state.error();
    if (!table) return void(std::puts(table.error().to_string().c_str()));
    CheckpointFiles checkpoints(state->checkpoints());
    std::vector<std::uint8_t> body(400 << 10, 7);
    const std::span<const std::uint8_t> part(body);
    bool fits = checkpoints.open().ok() && checkpoints.write("job", "kept", {&part, 1}).ok();
    std::printf("checkpoint: %d\n", fits);

    std::vector<std::string> answered;
    while (true) {
      JobRecord job = make_job("job" + std::to_string(answered.size()));
      job.request.append(20 << 10, 'r');
      const auto submitted = (*table)->submit(job, 1 << 20, "tester");
      if (!submitted) {
        std::printf("submit: %d %s\n", int(submitted.error().code), submitted.error().to_string().c_str());
        break;
      }
      answered.push_back(job.id);
    }
    const auto page = (*table)->list({}, "", 1 << 20);
    std::printf("lost: %d\n", int(answered.size()) - (page ? int(page->total) : -1));

    body.resize(3 << 20);
    const std::span<const std::uint8_t> large(body);
    const Status written = checkpoints.write("job", "lost", {&large, 1});
    std::printf("write: %s\n", written.ok() ? "ok" : written.error().to_string().c_str());
    const auto read = CheckpointFiles(state->checkpoints()).read("job", 1 << 30);
    std::printf("read: %s, %d damaged\n", read.file ? read.file->header.c_str() : "nothing", int(read.damaged.size()));
    for (const auto& entry : std::filesystem::directory_iterator(state->checkpoints())) {
      std::printf("left: %s\n", entry.path().filename().c_str());
    }
    // Room again.
    checkpoints.remove("job");
    std::printf("again: %d\n", int((*table)->submit(make_job("again"), 1 << 20, "tester").ok()));
  }
  {
    std::ofstream filling(ballast, std::ios::binary);
    for (int i = 0; i < 5000 && filling; ++i) filling << std::string(1024, 'b') << std::flush;
  }
  const auto state = StateFolder::open(path);
  std::printf("open: %s\n", state ? "ok" : state.error().to_string().c_str());
  std::fflush(stdout);
}

namespace {

TEST(FullDisk, LosesNothingAndIsTold) {
  TemporaryFolder folder;
  const std::string disk = folder / "disk";
  std::filesystem::create_directory(disk);
  const ProcessResult result = run_program(this_program(), {"small-disk", disk}, folder.path());
  if (result.out == "not permitted\n") GTEST_SKIP() << "skipped: file systems may not be mounted";
  const std::string jobs = disk + "/state/jobs.sqlite", checkpoint = disk + "/state/checkpoints/job.b";
  EXPECT_EQ(result.out, "checkpoint: 1\n"
                        "submit: " + std::to_string(int(ErrorCode::unavailable)) + " " + jobs +
                            ": the disk is full (database or disk is full)\n"
                        "lost: 0\n"
                        "write: " + checkpoint + ": cannot be written: No space left on device\n"
                        "read: kept, 0 damaged\n"
                        "left: job.a\n"
                        "again: 1\n"
                        "open: the state folder '" + disk + "/state' cannot be written (a file cannot be written: No "
                            "space left on device)\n")
      << result.err;
}

// Where nothing can be mounted: files may not grow beyond a size.
TEST(FullDisk, AWriteThatFailsIsTold) {
  TemporaryFolder folder;
  std::vector<std::string> notices;
  auto table = JobTable::open(folder / "jobs.sqlite", notices);
  ASSERT_TRUE(table);
  CheckpointFiles checkpoints(folder / "checkpoints");
  ASSERT_TRUE(checkpoints.open().ok());
  const std::vector<std::uint8_t> body(2 << 20, 7);
  const std::span<const std::uint8_t> part(body);
  ASSERT_TRUE(checkpoints.write("job", "kept", {&part, 1}).ok());

  const auto handler = signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit limited = before;
  limited.rlim_cur = 1 << 20;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  int answered = 0;
  std::optional<Error> error;
  while (!error) {
    JobRecord job = make_job("job" + std::to_string(answered));
    job.request.append(20 << 10, 'r');
    if (auto submitted = (*table)->submit(job, 1 << 20, "tester")) {
      ++answered;
    } else {
      error = submitted.error();
    }
    if (answered > 1000) break;
  }
  const Status written = checkpoints.write("job", "lost", {&part, 1});
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);

  ASSERT_TRUE(error);
  EXPECT_EQ(int(error->code), int(ErrorCode::unavailable)) << error->to_string();
  EXPECT_NE(error->to_string().find("jobs.sqlite"), std::string::npos) << error->to_string();
  EXPECT_GT(answered, 5);
  EXPECT_EQ((*table)->list({}, "", 1 << 20)->total, std::uint64_t(answered));
  EXPECT_TRUE((*table)->submit(make_job("again"), 1 << 20, "tester"));
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().to_string().find("File too large"), std::string::npos) << written.error().to_string();
  EXPECT_EQ(checkpoints.read("job", 1 << 30).file->header, "kept");
}

// A program that holds the write lock: callers are told after five seconds, reading goes on, and nothing is lost.
TEST(BusyDatabase, IsTold) {
  TemporaryFolder folder;
  const std::string file = folder / "jobs.sqlite";
  std::vector<std::string> notices;
  auto table = JobTable::open(file, notices);
  ASSERT_TRUE(table);
  ASSERT_TRUE((*table)->submit(make_job("one"), 10, "tester"));
  Process other(this_program(), {"write-lock", file}, folder.path());
  ASSERT_TRUE(other.wait_for_output("held\n")) << other.output();
  const auto refused = (*table)->submit(make_job("two"), 10, "tester");
  ASSERT_FALSE(refused);
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::unavailable));
  EXPECT_EQ(refused.error().to_string(),
            file + ": another program has held the database locked for 5 s (database is locked)");
  EXPECT_EQ((*table)->list({}, "", 10)->total, 1u);
  other.send_signal(SIGKILL);
  other.wait();
  EXPECT_TRUE((*table)->submit(make_job("two"), 10, "tester"));
  EXPECT_EQ((*table)->list({}, "", 10)->total, 2u);
}

}  // namespace
}  // namespace helio::test
