// The end of a daemon: drained by a signal, or killed.
#include <signal.h>
#include <sys/socket.h>

#include <filesystem>
#include <fstream>

#include "daemon_process.h"
#include "process.h"
#include "renderer/base/clock.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

// A fixture whose daemon is another process.
class DrainTest : public ServiceTest {
 protected:
  void start_process(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--log-level", "warn", "--render-threads", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    daemon_ = std::make_unique<DaemonProcess>(arguments);
    ASSERT_FALSE(daemon_->address().empty());
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    channel_ = grpc::CreateCustomChannel(daemon_->address(), grpc::InsecureChannelCredentials(), own);
    stub_ = pb::RenderService::NewStub(channel_);
  }
  std::string health() {
    const RawAnswer answer = send_raw(channel_, "/grpc.health.v1.Health/Check", {""});
    return answer.status.ok() ? answer.messages.at(0) : answer.status.error_message();
  }

  std::unique_ptr<DaemonProcess> daemon_;
  std::shared_ptr<grpc::Channel> channel_;
};

// The grace is longer than the test waits.
TEST_F(DrainTest, IdleDaemonEndsAtOnce) {
  start_process({"--drain-grace", "3600"});
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
}

// As a service manager sends it, to a daemon that has no files to read again.
TEST_F(DrainTest, SighupDoesNotEndIt) {
  TemporaryFolder folder;
  Process daemon(HELIO_DAEMON, {"--listen", "127.0.0.1:0", "--state", "none"}, folder.path());
  ASSERT_TRUE(daemon.wait_for_output("listening")) << daemon.errors();
  daemon.send_signal(SIGHUP);
  EXPECT_TRUE(daemon.wait_for_errors("no files of tokens or TLS to read again")) << daemon.errors();
  daemon.send_signal(SIGTERM);
  EXPECT_EQ(daemon.wait().exit_code, 0);
}

TEST_F(DrainTest, TheEndOfItsTerminalDrainsIt) {
  if (!has_pseudo_terminals()) GTEST_SKIP() << "no pseudo-terminals here";
  TemporaryFolder folder;
  Process daemon(HELIO_DAEMON, {"--listen", "127.0.0.1:0", "--state", "none"}, folder.path(),
                 Process::Stderr::all_terminal);
  ASSERT_TRUE(daemon.wait_for_errors("listening")) << daemon.errors();
  daemon.send_signal(SIGHUP);
  EXPECT_TRUE(daemon.wait_for_errors("no files of tokens or TLS to read again")) << daemon.errors();
  daemon.close_terminal();
  EXPECT_EQ(daemon.wait().exit_code, 0);
}

TEST_F(DrainTest, LiveFramesEndAndTheStreamIsTold) {
  for (const int signal : {SIGTERM, SIGINT}) {
    start_process({"--drain-grace", "3600"});
    StreamClient client(stub(), create_session(load_quad(), 256, 256));
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_tiles(2));
    daemon_->signal(signal);
    expect_status(client.status(), StatusCode::UNAVAILABLE, {"draining"});
    const auto messages = client.reader().messages();
    bool notice = false, ended = false;
    for (const auto& message : messages) {
      notice |= message.has_notice() && message.notice().severity() == pb::Notice::SEVERITY_DRAINING;
      ended |= message.has_frame_end() && message.frame_end().reason() == pb::END_REASON_CANCELLED;
    }
    EXPECT_TRUE(notice);
    EXPECT_TRUE(ended);
    EXPECT_EQ(daemon_->wait(), 0);
  }
}

TEST_F(DrainTest, JobsMayFinishWhileNewWorkIsRefused) {
  start_process({"--drain-grace", "10"});
  const std::string scene = load_quad();
  grpc::ClientContext context;
  pb::RunJobRequest job;
  job.set_scene_id(scene);
  job.mutable_settings()->set_width(128);
  job.mutable_settings()->set_height(128);
  job.mutable_budget()->set_time_s(1.5);
  auto reader = stub().RunJob(&context, job);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(health(), "\x08\x01");

  daemon_->signal(SIGTERM);
  EXPECT_TRUE(eventually([&] { return health() == "\x08\x02"; })) << "NOT_SERVING at once";
  pb::CreateSessionRequest create_request;
  pb::CreateSessionResponse created;
  create_request.set_scene_id(scene);
  expect_status(create(create_request, &created), StatusCode::UNAVAILABLE, {"draining"});
  pb::LoadSceneResponse loaded;
  expect_status(load(Upload().messages(), &loaded), StatusCode::UNAVAILABLE, {"draining"});
  pb::GetServerInfoResponse info;
  ASSERT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  EXPECT_TRUE(info.draining());

  while (reader->Read(&response)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_TRUE(response.has_result());
  EXPECT_EQ(response.result().end().reason(), pb::END_REASON_TIME) << "the job came to its own end";
  EXPECT_EQ(daemon_->wait(), 0);
}

TEST_F(DrainTest, JobsThatOutlastTheGraceAreCancelled) {
  start_process({"--drain-grace", "1"});
  grpc::ClientContext context;
  pb::RunJobRequest job;
  job.set_scene_id(load_quad());
  job.mutable_budget()->set_time_s(1000);
  auto reader = stub().RunJob(&context, job);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  daemon_->signal(SIGTERM);
  while (reader->Read(&response)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_TRUE(response.has_result());
  EXPECT_EQ(response.result().end().reason(), pb::END_REASON_CANCELLED);
  EXPECT_EQ(daemon_->wait(), 0);
}

TEST_F(DrainTest, SilentReaderDoesNotHoldTheDaemon) {
  start_process({"--drain-grace", "1"});
  StreamClient client(stub(), create_session(load_quad(), 1024, 1024), /*read=*/false);
  client.send(view(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
}

TEST_F(DrainTest, KilledDaemonIsUnavailableToItsClients) {
  start_process();
  StreamClient client(stub(), create_session(load_quad(), 128, 128));
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  daemon_->signal(SIGKILL);
  EXPECT_EQ(client.status().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(daemon_->wait(), 128 + SIGKILL);
}

// Small films: the allocator takes them from its heaps, and does not give those back by itself.
TEST_F(DrainTest, MemoryOfFilmsGoesBackToTheSystem) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the allocators of sanitizers keep what is freed";
#endif
  start_process({"--max-sessions", "256"});
  const std::string scene = load_quad();
  const auto live = [&](int sessions) {
    std::vector<std::string> ids;
    std::vector<std::unique_ptr<StreamClient>> clients;
    for (int i = 0; i < sessions; ++i) {
      ids.push_back(create_session(scene, 320, 180, 1));
      clients.push_back(std::make_unique<StreamClient>(stub(), ids.back()));
      clients.back()->send(view(1));
    }
    for (const auto& client : clients) EXPECT_TRUE(client->reader().wait_for_frame_end(1));
    const std::uint64_t most = daemon_->resident_bytes();
    for (const std::string& id : ids) {
      pb::CloseSessionRequest close;
      close.set_session_id(id);
      pb::CloseSessionResponse closed;
      EXPECT_TRUE(call(&pb::RenderService::Stub::CloseSession, close, &closed).ok());
    }
    return most;
  };
  const std::uint64_t before = daemon_->resident_bytes(), most = live(32);
  EXPECT_GT(most, before + (100 << 20));
  EXPECT_TRUE(eventually([&] { return daemon_->resident_bytes() <= before + before / 10; }))
      << (before >> 20) << " MiB before, " << (most >> 20) << " at most, " << (daemon_->resident_bytes() >> 20)
      << " after";
}

TEST_F(DrainTest, TakenPortIsAnError) {
  start_process();
  DaemonProcess second({"--listen", daemon_->address(), "--log-level", "off"});
  EXPECT_TRUE(second.address().empty());
  EXPECT_EQ(second.wait(), 1);
}

TEST_F(DrainTest, PortFileAndEnvironment) {
  const auto path = std::filesystem::temp_directory_path() / ("helio-port-" + std::to_string(getpid()));
  {
    // Another daemon's draft, on a disk that is full.
    std::filesystem::create_symlink("/dev/full", path.string() + ".tmp");
    DaemonProcess daemon({"--port-file", path.string(), "--log-level", "off"}, {"HELIOGRAPH_MAX_SESSIONS=5"});
    std::string port;
    std::ifstream(path) >> port;
    EXPECT_EQ("127.0.0.1:" + port, daemon.address());
    auto stub = pb::RenderService::NewStub(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    pb::GetServerInfoResponse info;
    ASSERT_TRUE(stub->GetServerInfo(&context, pb::GetServerInfoRequest(), &info).ok());
    EXPECT_EQ(info.limits().max_sessions(), 5);
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(), 0);
  }
  std::filesystem::remove(path);
  std::filesystem::remove(path.string() + ".tmp");
  DaemonProcess bad({"--max-jobs", "-1"});
  EXPECT_EQ(bad.wait(), 2);
}

}  // namespace
}  // namespace helio::test
