// A state folder that a daemon finds in use, locked or damaged when it starts, and one whose file may not grow.
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <regex>

#include "kept_jobs_fixture.h"
#include "server/state/sqlite_database.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples

// The daemon is another process, whose log can be read.
class StateTrouble : public KeptJobsTest {
 protected:
  void begin() {
    daemon_ = std::make_unique<Process>(
        HELIO_DAEMON,
        std::vector<std::string>{"--listen", "127.0.0.1:0", "--log-level", "warn", "--render-threads", "2",
                                 "--checkpoint-interval", "0.02", "--state", folder_ / "state"},
        folder_.path());
  }
  void connect() {
    ASSERT_TRUE(daemon_->wait_for_output("listening on ", 60 * kPatience)) << daemon_->errors();
    ASSERT_TRUE(daemon_->wait_for_output("\n"));
    std::smatch address;
    const std::string said = daemon_->output();
    ASSERT_TRUE(std::regex_search(said, address, std::regex("listening on ([0-9.]+:[0-9]+)\n"))) << said;
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = pb::RenderService::NewStub(
        grpc::CreateCustomChannel(address[1], grpc::InsecureChannelCredentials(), own));
  }
  void spawn() {
    begin();
    connect();
  }
  void kill_it() {
    daemon_->send_signal(SIGKILL);
    daemon_->wait();
  }
  std::vector<std::string> set_aside() const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder_ / "state")) {
      const std::string name = entry.path().filename().string();
      if (name.rfind("jobs.sqlite.damaged-", 0) == 0 && name.find("-wal") == std::string::npos &&
          name.find("-shm") == std::string::npos) {
        files.push_back(entry.path().string());
      }
    }
    return files;
  }

  std::unique_ptr<Process> daemon_;
};

TEST_F(StateTrouble, ADamagedDatabaseIsToldAndKeptAndTheDaemonStarts) {
  spawn();
  submitted(request(load_quad(), 16, kNoEnd));
  daemon_->send_signal(SIGTERM);
  EXPECT_EQ(daemon_->wait().exit_code, 0);
  const std::string file = folder_ / "state/jobs.sqlite";
  std::string bytes = read_file(file);
  ASSERT_GT(bytes.size(), 4096u);
  for (std::size_t i = 100; i < bytes.size(); ++i) bytes[i] = char(i * 31);
  write_file(file, bytes);

  spawn();
  EXPECT_NE(daemon_->errors().find("the database is damaged"), std::string::npos) << daemon_->errors();
  const auto kept = set_aside();
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_TRUE(read_file(kept[0]) == bytes) << "the copy is another";
  EXPECT_NE(daemon_->errors().find(fs::path(kept[0]).filename().string()), std::string::npos) << daemon_->errors();
  const std::string id = submitted(request(load_quad(), 16, 4));
  EXPECT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  pb::ListJobsResponse listed;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListJobs, pb::ListJobsRequest(), &listed).ok());
  EXPECT_EQ(listed.total(), 1u);
}

// Another program holds the write lock when the daemon starts, and lets go of it later.
TEST_F(StateTrouble, ALockedDatabaseIsToldAndTheDaemonStarts) {
  spawn();
  const std::string scene = load_scene();
  const std::string id = submitted(request(scene, 48, 512));
  wait_for_samples(id, 1);
  kill_it();
  auto other = SqliteDatabase::open(folder_ / "state/jobs.sqlite", SqliteDatabase::Access::write);
  ASSERT_TRUE(other.ok()) << other.error().to_string();
  ASSERT_TRUE((*other)->execute("BEGIN IMMEDIATE").ok());

  spawn();
  EXPECT_NE(daemon_->errors().find("locked"), std::string::npos) << daemon_->errors();
  EXPECT_EQ(job(id).state(), pb::JOB_STATE_RUNNING) << "as the table has it, which can be read";
  load_scene();
  pb::SubmitJobResponse refused;
  expect_status(submit(request(scene, 16, 4), &refused), StatusCode::UNAVAILABLE, {"jobs.sqlite", "locked"});
  ASSERT_TRUE((*other)->execute("ROLLBACK").ok());
  other->reset();
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_EQ(done.attempt(), 2u);
  EXPECT_TRUE(submit(request(scene, 16, 4), &refused).ok());
}

// A picture whose row cannot be written waits for the database, not for a person.
TEST_F(StateTrouble, ADatabaseThatIsLockedWhileAJobEndsDelaysItsEnd) {
  spawn();
  const std::string id = submitted(request(load_scene(), 64, 1024));
  wait_for_samples(id, 1);
  auto other = SqliteDatabase::open(folder_ / "state/jobs.sqlite", SqliteDatabase::Access::write);
  ASSERT_TRUE(other.ok()) << other.error().to_string();
  ASSERT_TRUE((*other)->execute("BEGIN IMMEDIATE").ok());
  ASSERT_EQ(job(id).state(), pb::JOB_STATE_RUNNING) << "it has ended already";
  ASSERT_TRUE(eventually([&] { return !job(id).has_progress(); }));
  std::this_thread::sleep_for(std::chrono::seconds(6));  // longer than a write waits for another
  EXPECT_EQ(job(id).state(), pb::JOB_STATE_RUNNING) << "as the table has it";
  ASSERT_TRUE((*other)->execute("ROLLBACK").ok());
  other->reset();
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_TRUE(done.same_bits());
  for (const pb::JobEvent& event : events(id)) EXPECT_NE(event.to(), pb::JOB_STATE_PAUSED) << event.reason();
  EXPECT_FALSE(result(id).empty());
}

TEST_F(StateTrouble, ASecondDaemonIsRefused) {
  spawn();
  const std::string id = submitted(request(load_quad(), 16, kNoEnd));
  const auto first = std::move(daemon_);
  begin();
  const ProcessResult second = daemon_->wait(60 * kPatience);
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_EQ(second.out, "");
  EXPECT_NE(second.err.find(folder_ / "state"), std::string::npos) << second.err;
  EXPECT_EQ(wait_for(id, pb::JOB_STATE_RUNNING).state(), pb::JOB_STATE_RUNNING) << "the first one works on";
}

// A limit on the size of files (`ulimit -f`, LimitFSIZE) sends a signal that would end the daemon.
TEST_F(StateTrouble, AFileThatMayNotGrowDoesNotEndTheDaemon) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit limited = before;
  limited.rlim_cur = 256 << 10;  // the database and its shared index fit, a large picture does not
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limited), 0);
  begin();
  setrlimit(RLIMIT_FSIZE, &before);
  connect();
  pb::SubmitJobRequest large = request(load_scene(), 512, 1);
  large.mutable_job()->mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  const std::string id = submitted(large);
  const pb::Job paused = wait_for(id, pb::JOB_STATE_PAUSED);
  EXPECT_EQ(paused.state(), pb::JOB_STATE_PAUSED) << paused.reason();
  EXPECT_NE(paused.reason().find("File too large"), std::string::npos) << paused.reason();
  daemon_->send_signal(SIGTERM);
  EXPECT_EQ(daemon_->wait().exit_code, 0);
}

}  // namespace
}  // namespace helio::test
