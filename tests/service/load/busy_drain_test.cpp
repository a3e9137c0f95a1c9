// SIGTERM while many clients work, each in its own way: every call ends with a reason, and the next daemon goes on with
// the jobs that are kept.
#include <signal.h>

#include <filesystem>
#include <latch>
#include <optional>

#include "../daemon_process.h"
#include "../jobs/kept_jobs_fixture.h"
#include "../web/web_peer.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples

// A client of its own connection.
class Worker {
 public:
  Worker(const std::string& address, const std::string& scene, std::latch& all_begun)
      : scene_(scene), all_begun_(all_begun) {
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = pb::RenderService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
  }
  ~Worker() { begun(); }  // nobody waits for one that could not begin

  pb::RenderService::Stub& stub() { return *stub_; }
  const std::string& scene() const { return scene_; }
  // Its work is on the way.
  void begun() {
    if (!begun_) all_begun_.count_down();
    begun_ = true;
  }
  bool has_begun() const { return begun_; }
  // A context that ends a call which would hang.
  static std::unique_ptr<grpc::ClientContext> context() {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(120 * kPatience));
    return context;
  }
  std::string session(int side) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_);
    request.mutable_settings()->set_width(side);
    request.mutable_settings()->set_height(side);
    pb::CreateSessionResponse response;
    const grpc::Status status = stub_->CreateSession(context().get(), request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.session_id();
  }

 private:
  const std::string scene_;
  std::latch& all_begun_;
  std::unique_ptr<pb::RenderService::Stub> stub_;
  bool begun_ = false;
};

// What a client does until its call ends otherwise than well: that status.
using Work = grpc::Status (*)(Worker&);

template <class Call>
grpc::Status repeat(Worker& worker, const Call& call) {
  for (int i = 0;; ++i) {
    const grpc::Status status = call(i);
    if (!status.ok()) return status;
    worker.begun();
  }
}

bool is_draining_notice(const pb::StreamResponse& response) {
  return response.has_notice() && response.notice().severity() == pb::Notice::SEVERITY_DRAINING;
}

grpc::Status move_a_camera(Worker& worker) {
  const std::string session = worker.session(160);
  const auto context = Worker::context();
  auto stream = worker.stub().StreamFrames(context.get());
  pb::StreamRequest request;
  request.mutable_open()->set_session_id(session);
  stream->Write(request);
  std::uint64_t id = 0;
  bool notice = false;
  *request.mutable_view() = view(++id);
  stream->Write(request);
  pb::StreamResponse response;
  while (stream->Read(&response)) {
    notice |= is_draining_notice(response);
    if (!response.has_tile()) continue;
    worker.begun();
    ++id;
    *request.mutable_view() = view(id, 0.001 * double(id % 100));
    stream->Write(request);
  }
  EXPECT_TRUE(notice) << "a stream ended without a notice";
  return stream->Finish();
}

grpc::Status watch_frames(Worker& worker) {
  pb::UpdateSessionRequest update;
  update.set_session_id(worker.session(160));
  *update.mutable_view() = view(1);
  pb::UpdateSessionResponse updated;
  EXPECT_TRUE(worker.stub().UpdateSession(Worker::context().get(), update, &updated).ok());
  const auto context = Worker::context();
  pb::WatchFramesRequest watch;
  watch.set_session_id(update.session_id());
  auto reader = worker.stub().WatchFrames(context.get(), watch);
  pb::StreamResponse response;
  bool notice = false;
  while (reader->Read(&response)) {
    notice |= is_draining_notice(response);
    if (response.has_tile()) worker.begun();
  }
  EXPECT_TRUE(notice) << "a watch ended without a notice";
  return reader->Finish();
}

grpc::Status wait_before_open(Worker& worker) {
  const auto context = Worker::context();
  auto stream = worker.stub().StreamFrames(context.get());
  worker.begun();
  pb::StreamResponse response;
  while (stream->Read(&response)) {
  }
  return stream->Finish();
}

grpc::Status stop_in_an_upload(Worker& worker) {
  const auto context = Worker::context();
  pb::LoadSceneResponse response;
  auto writer = worker.stub().LoadScene(context.get(), &response);
  writer->Write(Upload().begin());
  writer->Write(Upload().begin_file());
  worker.begun();
  return writer->Finish();
}

// A job that ends with its call.
pb::RunJobRequest endless_job(const std::string& scene) {
  pb::RunJobRequest job;
  job.set_scene_id(scene);
  job.mutable_settings()->set_width(64);
  job.mutable_settings()->set_height(64);
  job.mutable_budget()->set_samples(kNoEnd);
  return job;
}

grpc::Status run_a_job(Worker& worker) {
  const auto context = Worker::context();
  auto reader = worker.stub().RunJob(context.get(), endless_job(worker.scene()));
  pb::RunJobResponse response;
  std::optional<pb::FrameEnd> end;
  while (reader->Read(&response)) {
    worker.begun();
    if (response.has_result()) end = response.result().end();
  }
  const grpc::Status status = reader->Finish();
  if (!status.ok()) return status;
  EXPECT_TRUE(end) << "a job ended without a result";
  return end && end->reason() == pb::END_REASON_CANCELLED ? grpc::Status(StatusCode::CANCELLED, "with its result")
                                                          : grpc::Status(StatusCode::UNKNOWN, "");
}

grpc::Status run_a_detached_job(Worker& worker) {
  const auto context = Worker::context();
  pb::RunJobRequest job = endless_job(worker.scene());
  job.set_detach(true);
  auto reader = worker.stub().RunJob(context.get(), job);
  pb::RunJobResponse response;
  while (reader->Read(&response)) worker.begun();
  return reader->Finish();
}

grpc::Status load_scenes(Worker& worker) {
  return repeat(worker, [&](int i) {
    Upload upload;
    upload.bytes = quad_gltf(2 + i % 5);
    const auto context = Worker::context();
    pb::LoadSceneResponse response;
    auto writer = worker.stub().LoadScene(context.get(), &response);
    for (const auto& message : upload.messages()) {
      if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    if (!status.ok()) return status;
    pb::UnloadSceneRequest unload;  // refused where another loader has the scene in hand
    unload.set_scene_id(response.scene().scene_id());
    pb::UnloadSceneResponse unloaded;
    worker.stub().UnloadScene(Worker::context().get(), unload, &unloaded);
    return status;
  });
}

grpc::Status edit_scenes(Worker& worker) {
  return repeat(worker, [&](int i) {
    pb::EditSceneRequest edit;
    edit.set_scene_id(worker.scene());
    edit.add_edits()->mutable_material()->set_index(0);
    edit.mutable_edits(0)->mutable_material()->mutable_base_color()->set_x(0.001 * double(i % 1000));
    pb::EditSceneResponse edited;
    return worker.stub().EditScene(Worker::context().get(), edit, &edited);
  });
}

grpc::Status compare_modes(Worker& worker) {
  pb::CompareRequest request;
  request.set_scene_id(worker.scene());
  for (const char* name : {"first", "second"}) {
    pb::CompareMode& mode = *request.add_modes();
    mode.set_name(name);
    mode.mutable_settings()->set_width(64);
    mode.mutable_settings()->set_height(64);
  }
  request.set_seeds(2);
  request.add_samples(1u << 24);
  request.mutable_reference()->mutable_rendered()->set_error(1);
  const auto context = Worker::context();
  auto reader = worker.stub().Compare(context.get(), request);
  pb::CompareResponse response;
  while (reader->Read(&response)) worker.begun();
  return reader->Finish();
}

grpc::Status open_and_close(Worker& worker) {
  return repeat(worker, [&](int) {
    pb::CreateSessionRequest create;
    create.set_scene_id(worker.scene());
    create.mutable_settings()->set_width(32);
    create.mutable_settings()->set_height(32);
    pb::CreateSessionResponse created;
    const grpc::Status status = worker.stub().CreateSession(Worker::context().get(), create, &created);
    pb::CloseSessionRequest close;
    close.set_session_id(created.session_id());
    pb::CloseSessionResponse closed;
    if (status.ok()) worker.stub().CloseSession(Worker::context().get(), close, &closed);
    return status;
  });
}

grpc::Status submit_and_cancel(Worker& worker) {
  return repeat(worker, [&](int) {
    pb::SubmitJobRequest submit;
    *submit.mutable_job() = endless_job(worker.scene());
    submit.set_name("to be cancelled");
    pb::SubmitJobResponse submitted;
    const grpc::Status status = worker.stub().SubmitJob(Worker::context().get(), submit, &submitted);
    pb::CancelJobRequest cancel;
    cancel.set_job_id(submitted.job().job_id());
    pb::CancelJobResponse cancelled;
    if (status.ok()) worker.stub().CancelJob(Worker::context().get(), cancel, &cancelled);
    return status;
  });
}

grpc::Status watch_jobs(Worker& worker) {
  const auto context = Worker::context();
  pb::WatchJobRequest watch;
  watch.set_progress(true);
  auto reader = worker.stub().WatchJob(context.get(), watch);
  pb::WatchJobResponse response;
  while (reader->Read(&response)) worker.begun();
  return reader->Finish();
}

struct Kind {
  const char* name;
  Work work;
  int clients;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"moves a camera", move_a_camera, 8},    {"watches frames", watch_frames, 3},
      {"waits before open", wait_before_open, 1}, {"stops in an upload", stop_in_an_upload, 1},
      {"runs a job", run_a_job, 3},            {"runs a detached job", run_a_detached_job, 1},
      {"loads scenes", load_scenes, 3},        {"edits scenes", edit_scenes, 3},
      {"compares modes", compare_modes, 2},    {"opens and closes", open_and_close, 2},
      {"submits and cancels", submit_and_cancel, 1}, {"watches jobs", watch_jobs, 2},
  };
  return all;
}

class BusyDrainTest : public KeptJobsTest {
 protected:
  void spawn(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--log-level", "error", "--render-threads", "2",
                                          "--state",     folder_ / "state"};
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
    return answer.status.ok() && !answer.messages.empty() ? answer.messages[0] : answer.status.error_message();
  }

  std::unique_ptr<DaemonProcess> daemon_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(BusyDrainTest, EveryCallEndsWithAReason) {
  // The jobs that are run hold the daemon until half a second before the end of this.
  spawn({"--drain-grace", std::to_string(5 * kPatience), "--http", "127.0.0.1:0"});
  const std::string scene = load_quad();
  std::vector<std::string> kept;
  for (int i = 0; i < 2; ++i) kept.push_back(submitted(request(scene, 48, kNoEnd)));
  for (const std::string& id : kept) wait_for_samples(id, 1);
  pb::GetServerInfoResponse info;
  ASSERT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  const auto page = [&](const std::string& path) { return WebPeer(info.http_address()).get(path).status; };
  EXPECT_EQ(page("/readyz"), 200);

  struct Client {
    const Kind* kind;
    grpc::Status status = {};
    bool begun = false;
    std::thread thread = {};
  };
  std::vector<Client> clients;
  for (const Kind& kind : kinds()) {
    for (int i = 0; i < kind.clients; ++i) clients.push_back({&kind});
  }
  ASSERT_EQ(clients.size(), 30u);
  std::latch all_begun{std::ptrdiff_t(clients.size())};
  for (Client& client : clients) {
    client.thread = std::thread([&] {
      Worker worker(daemon_->address(), scene, all_begun);
      client.status = client.kind->work(worker);
      client.begun = worker.has_begun();
    });
  }
  all_begun.wait();

  daemon_->signal(SIGTERM);
  EXPECT_TRUE(eventually([&] { return health() == "\x08\x02"; })) << health();
  EXPECT_EQ(page("/readyz"), 503);
  EXPECT_EQ(page("/healthz"), 200);
  pb::GetServerInfoResponse draining;
  EXPECT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &draining).ok());
  EXPECT_TRUE(draining.draining());
  for (Client& client : clients) client.thread.join();
  EXPECT_EQ(daemon_->wait(), 0);

  for (const Client& client : clients) {
    SCOPED_TRACE(client.kind->name);
    EXPECT_TRUE(client.begun);
    if (client.kind->work == run_a_job) {
      EXPECT_EQ(client.status.error_message(), "with its result");
      continue;
    }
    // The stream of a session that the next daemon has again says so instead.
    const bool of_a_session = client.kind->work == move_a_camera || client.kind->work == watch_frames;
    expect_status(client.status, StatusCode::UNAVAILABLE,
                  {of_a_session ? "the daemon " : "the daemon is draining", "try again in "});
    EXPECT_NE(client.status.error_details().find("type.googleapis.com/google.rpc.RetryInfo"), std::string::npos);
  }

  // The next daemon has the jobs that ran in its queue, with what they have rendered.
  spawn({"--max-jobs", "0"});
  pb::ListJobsRequest list;
  for (const pb::JobState state : {pb::JOB_STATE_QUEUED, pb::JOB_STATE_RUNNING, pb::JOB_STATE_PAUSED})
    list.add_states(state);
  pb::ListJobsResponse listed;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListJobs, list, &listed).ok());
  int queued = 0;
  for (const pb::Job& one : listed.jobs()) {
    EXPECT_EQ(one.state(), pb::JOB_STATE_QUEUED) << one.reason();
    queued += one.name().empty() ? 1 : 0;  // the one that is submitted to be cancelled may be there
  }
  EXPECT_EQ(queued, 3) << "two were submitted, one was detached";
  for (const std::string& id : kept) {
    EXPECT_EQ(job(id).reason(), "the daemon stopped");
    const std::string checkpoints = folder_ / "state/checkpoints/";
    EXPECT_TRUE(fs::exists(checkpoints + id + ".a") || fs::exists(checkpoints + id + ".b")) << id;
  }
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
}

}  // namespace
}  // namespace helio::test
