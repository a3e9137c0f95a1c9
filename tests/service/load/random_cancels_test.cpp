// Calls of every kind that are given up at any moment: nothing of them stays behind, and whoever does not give up is
// served as before.
//
// HELIO_RANDOM_CANCELS is how many (the full tier's, by `./check --full load` under sanitizers as well: 10,000).
#include <absl/strings/numbers.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <random>

#include "../jobs/kept_jobs_fixture.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
using Random = std::mt19937;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples
constexpr int kThreads = 8;

int between(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

int how_many() {
  const char* wish = std::getenv("HELIO_RANDOM_CANCELS");
  int wished = 0;
  if (wish && absl::SimpleAtoi(wish, &wished) && wished > 0) return wished;
  return by_tier(300, 10'000);
}

// What came of the calls that were given up.
struct Outcomes {
  std::atomic<int> given_up = 0;  // before they came to their end
  std::atomic<int> ended = 0;     // by themselves
  std::mutex mutex;
  std::vector<std::string> wrong;  // with mutex: ends that no cancel explains

  void add(const char* what, const grpc::Status& status) {
    switch (status.error_code()) {
      case StatusCode::OK:
        ++ended;
        return;
      case StatusCode::CANCELLED:
      case StatusCode::DEADLINE_EXCEEDED:
      case StatusCode::ABORTED:  // another stream took the session over
        ++given_up;
        return;
      case StatusCode::RESOURCE_EXHAUSTED:  // a place in a queue, which time cures
        if (status.error_message().find("try again in") != std::string::npos) {
          ++ended;
          return;
        }
        break;
      default:
        break;
    }
    const std::lock_guard lock(mutex);
    wrong.push_back(std::string(what) + ": " + std::to_string(status.error_code()) + " " + status.error_message());
  }
};

// Gives one call after the other up.
class GivesUp {
 public:
  GivesUp(pb::RenderService::Stub& stub, std::string scene_id, std::uint32_t seed, Outcomes& outcomes)
      : stub_(stub), scene_id_(std::move(scene_id)), random_(seed), outcomes_(outcomes) {}

  void one() {
    static constexpr void (GivesUp::*kKinds[])() = {&GivesUp::stream,    &GivesUp::stream,     &GivesUp::watch_frames,
                                                   &GivesUp::run_job,   &GivesUp::kept_job,   &GivesUp::kept_job,
                                                   &GivesUp::watch_job, &GivesUp::load,       &GivesUp::edit,
                                                   &GivesUp::compare,   &GivesUp::get_result, &GivesUp::short_calls};
    (this->*kKinds[between(random_, 0, int(std::size(kKinds)) - 1)])();
  }

 private:
  // Until a call is given up: most often while it begins.
  std::chrono::microseconds a_moment() {
    const int most = 1 << between(random_, 0, 15);
    return std::chrono::microseconds(between(random_, 0, most) * kPatience);
  }
  std::unique_ptr<grpc::ClientContext> context() {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(120 * kPatience));  // of a hang
    return context;
  }
  // That gives up by itself.
  std::unique_ptr<grpc::ClientContext> impatient() {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + a_moment());
    return context;
  }
  template <class Reader, class Response>
  grpc::Status read_until_given_up(grpc::ClientContext& context, Reader& reader, Response response) {
    std::thread canceller([&, moment = a_moment()] {
      std::this_thread::sleep_for(moment);
      context.TryCancel();
    });
    while (reader.Read(&response)) {
    }
    const grpc::Status status = reader.Finish();
    canceller.join();
    return status;
  }
  void set_picture(pb::RenderSettings& settings) {
    static constexpr pb::Integrator kIntegrators[] = {pb::INTEGRATOR_PATH, pb::INTEGRATOR_PT_BDPT, pb::INTEGRATOR_LVC};
    settings.set_width(std::uint32_t(between(random_, 8, 96)));
    settings.set_height(std::uint32_t(between(random_, 8, 96)));
    settings.set_integrator(kIntegrators[between(random_, 0, 2)]);
    settings.set_mode(settings.integrator() == pb::INTEGRATOR_LVC ? pb::MODE_PT
                                                                  : pb::Mode(between(random_, pb::MODE_PT, 4)));
  }
  // Empty where the daemon had no place.
  std::string session() {
    pb::CreateSessionRequest create;
    create.set_scene_id(scene_id_);
    set_picture(*create.mutable_settings());
    create.set_grace_s(between(random_, 0, 1) == 0 ? 0.05 : 0);
    pb::CreateSessionResponse created;
    const grpc::Status status = stub_.CreateSession(context().get(), create, &created);
    outcomes_.add("CreateSession", status);
    return created.session_id();
  }
  void close(const std::string& id) {
    pb::CloseSessionRequest request;
    request.set_session_id(id);
    pb::CloseSessionResponse response;
    const grpc::Status status = stub_.CloseSession(context().get(), request, &response);
    add_unless_gone("CloseSession", status);
  }
  // NOT_FOUND: the grace of its session was over.
  void add_unless_gone(const char* what, const grpc::Status& status) {
    if (status.error_code() != StatusCode::NOT_FOUND) outcomes_.add(what, status);
  }

  void stream() {
    const std::string id = session();
    if (id.empty()) return;
    const auto call = context();
    const auto stream = stub_.StreamFrames(call.get());
    pb::StreamRequest request;
    if (between(random_, 0, 7) > 0) {
      request.mutable_open()->set_session_id(id);
      stream->Write(request);
      for (int i = between(random_, 1, 3); i > 0; --i) {
        if (between(random_, 0, 2) == 0) {
          set_picture(*request.mutable_settings());
          stream->Write(request);
        }
        *request.mutable_view() = view(std::uint64_t(4 - i), 0.1 * i);
        stream->Write(request);
      }
    }
    if (between(random_, 0, 3) == 0) {
      std::this_thread::sleep_for(a_moment());
      close(id);
      call->TryCancel();
      outcomes_.add("StreamFrames, closed", stream->Finish());
      return;
    }
    add_unless_gone("StreamFrames", read_until_given_up(*call, *stream, pb::StreamResponse()));
    close(id);
  }

  void watch_frames() {
    const std::string id = session();
    if (id.empty()) return;
    pb::UpdateSessionRequest update;
    update.set_session_id(id);
    *update.mutable_view() = view(1);
    pb::UpdateSessionResponse updated;
    add_unless_gone("UpdateSession", stub_.UpdateSession(context().get(), update, &updated));
    const auto call = context();
    pb::WatchFramesRequest watch;
    watch.set_session_id(id);
    const auto reader = stub_.WatchFrames(call.get(), watch);
    add_unless_gone("WatchFrames", read_until_given_up(*call, *reader, pb::StreamResponse()));
    close(id);
  }

  pb::RunJobRequest job(std::uint32_t samples) {
    pb::RunJobRequest job;
    job.set_scene_id(scene_id_);
    set_picture(*job.mutable_settings());
    job.mutable_budget()->set_samples(samples);
    for (int i = between(random_, 0, 3); i > 0; --i) *job.add_views() = view(1, 0.1 * i).camera();
    return job;
  }

  void run_job() {
    const auto call = context();
    pb::RunJobRequest request = job(between(random_, 0, 3) == 0 ? 2 : kNoEnd);
    request.set_preview_tiles(between(random_, 0, 1) == 0);
    const auto reader = stub_.RunJob(call.get(), request);
    outcomes_.add("RunJob", read_until_given_up(*call, *reader, pb::RunJobResponse()));
  }

  // Submitted, and then cancelled or paused and cancelled, at any moment.
  void kept_job() {
    pb::SubmitJobRequest submit;
    *submit.mutable_job() = job(between(random_, 0, 3) == 0 ? 2 : kNoEnd);
    pb::SubmitJobResponse submitted;
    const grpc::Status status = stub_.SubmitJob(context().get(), submit, &submitted);
    outcomes_.add("SubmitJob", status);
    if (!status.ok()) return;
    std::this_thread::sleep_for(a_moment());
    const std::string& id = submitted.job().job_id();
    if (between(random_, 0, 2) == 0) {
      pb::PauseJobRequest pause;
      pause.set_job_id(id);
      pb::Job paused;
      add_unless_over("PauseJob", stub_.PauseJob(context().get(), pause, &paused));
      std::this_thread::sleep_for(a_moment());
      if (between(random_, 0, 1) == 0) {
        pb::ResumeJobRequest resume;
        resume.set_job_id(id);
        add_unless_over("ResumeJob", stub_.ResumeJob(context().get(), resume, &paused));
      }
    }
    pb::CancelJobRequest cancel;
    cancel.set_job_id(id);
    pb::CancelJobResponse cancelled;
    add_unless_over("CancelJob", stub_.CancelJob(context().get(), cancel, &cancelled));
    last_job_ = id;
  }
  // FAILED_PRECONDITION: not from the state that the job has by now.
  void add_unless_over(const char* what, const grpc::Status& status) {
    if (status.error_code() != StatusCode::FAILED_PRECONDITION) outcomes_.add(what, status);
  }

  void watch_job() {
    const auto call = context();
    pb::WatchJobRequest request;
    request.set_from_seq(1);
    request.set_progress(true);
    const auto reader = stub_.WatchJob(call.get(), request);
    outcomes_.add("WatchJob", read_until_given_up(*call, *reader, pb::WatchJobResponse()));
  }

  void get_result() {
    if (last_job_.empty()) return kept_job();
    const auto call = context();
    pb::GetResultRequest request;
    request.set_job_id(last_job_);
    const auto reader = stub_.GetResult(call.get(), request);
    add_unless_over("GetResult", read_until_given_up(*call, *reader, pb::GetResultResponse()));
  }

  void load() {
    Upload upload;
    upload.bytes = quad_gltf(2 + between(random_, 0, 20));
    const auto call = impatient();
    pb::LoadSceneResponse response;
    const auto writer = stub_.LoadScene(call.get(), &response);
    const auto messages = upload.messages();
    const std::size_t sent = std::size_t(between(random_, 1, int(messages.size())));
    for (std::size_t i = 0; i < sent; ++i) writer->Write(messages[i]);
    if (sent == messages.size()) writer->WritesDone();
    outcomes_.add("LoadScene", writer->Finish());
  }

  void edit() {
    pb::EditSceneRequest edit;
    edit.set_scene_id(scene_id_);
    edit.add_edits()->mutable_material()->set_index(0);
    edit.mutable_edits(0)->mutable_material()->mutable_base_color()->set_x(0.01 * between(random_, 0, 50));
    pb::EditSceneResponse edited;
    outcomes_.add("EditScene", stub_.EditScene(impatient().get(), edit, &edited));
  }

  void compare() {
    pb::CompareRequest request;
    request.set_scene_id(scene_id_);
    for (const char* name : {"first", "second"}) {
      pb::CompareMode& mode = *request.add_modes();
      mode.set_name(name);
      mode.mutable_settings()->set_width(16);
      mode.mutable_settings()->set_height(16);
    }
    request.set_seeds(2);
    request.add_samples(between(random_, 0, 3) == 0 ? 2 : 1u << 24);
    request.mutable_reference()->mutable_rendered()->set_error(1);
    const auto call = context();
    const auto reader = stub_.Compare(call.get(), request);
    outcomes_.add("Compare", read_until_given_up(*call, *reader, pb::CompareResponse()));
  }

  void short_calls() {
    pb::CreateSessionRequest create;
    create.set_scene_id(scene_id_);
    set_picture(*create.mutable_settings());
    create.set_grace_s(0.05);  // nobody may know of it
    pb::CreateSessionResponse created;
    outcomes_.add("CreateSession, given up", stub_.CreateSession(impatient().get(), create, &created));
    pb::ListJobsResponse jobs;
    outcomes_.add("ListJobs, given up", stub_.ListJobs(impatient().get(), pb::ListJobsRequest(), &jobs));
    pb::SubmitJobRequest submit;
    *submit.mutable_job() = job(2);  // it comes to its end by itself
    pb::SubmitJobResponse submitted;
    outcomes_.add("SubmitJob, given up", stub_.SubmitJob(impatient().get(), submit, &submitted));
  }

  pb::RenderService::Stub& stub_;
  const std::string scene_id_;
  Random random_;
  Outcomes& outcomes_;
  std::string last_job_;
};

using RandomCancels = KeptJobsTest;

TEST_F(RandomCancels, LeaveNothingBehind) {
  start_daemon([](ServerConfig& config) {
    config.max_jobs = 4;
    config.session_grace_s = 1;
    config.checkpoint_interval_s = 0.01;
    config.max_reference_memory = 1;  // none is kept
    config.max_memory = 4ull << 30;
  });
  spdlog::set_level(spdlog::level::err);
  const std::string scene = load_scene();
  const auto picture = [&] {
    const std::string id = submitted(request(scene, 32, 16));
    const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
    return result(id);
  };
  const std::string before = picture();

  Outcomes outcomes;
  std::vector<std::thread> threads;
  std::vector<std::unique_ptr<pb::RenderService::Stub>> stubs;
  const int calls = how_many();
  for (int i = 0; i < kThreads; ++i) stubs.push_back(new_stub());
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i, share = (calls + kThreads - 1) / kThreads] {
      GivesUp gives_up(*stubs[std::size_t(i)], scene, std::uint32_t(1 + i), outcomes);
      for (int call = 0; call < share; ++call) gives_up.one();
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::printf("%d calls were given up, %d ended by themselves\n", int(outcomes.given_up), int(outcomes.ended));
  EXPECT_TRUE(outcomes.wrong.empty()) << outcomes.wrong.size() << " ends, the first: " << outcomes.wrong[0];
  EXPECT_GT(outcomes.given_up.load(), calls / 4);

  EXPECT_TRUE(before == picture()) << "the bits are others afterwards";
  EXPECT_TRUE(eventually([&] {
    pb::ListSessionsResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
    return list.sessions().empty();
  }));
  EXPECT_TRUE(eventually([&] {
    pb::ListJobsRequest list;
    for (const pb::JobState state : {pb::JOB_STATE_QUEUED, pb::JOB_STATE_RUNNING, pb::JOB_STATE_PAUSED})
      list.add_states(state);
    pb::ListJobsResponse listed;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListJobs, list, &listed).ok());
    return listed.total() == 0;
  })) << "a job is stuck";
  // Without scenes nothing is left that may be held.
  pb::ListScenesResponse scenes;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &scenes).ok());
  for (const pb::SceneInfo& info : scenes.scenes()) {
    pb::UnloadSceneRequest unload;
    unload.set_scene_id(info.scene_id());
    pb::UnloadSceneResponse unloaded;
    EXPECT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }))
        << info.name() << " is held";
  }
  EXPECT_TRUE(eventually([&] { return server_->memory_used() == 0; })) << server_->memory_used() << " bytes are held";
}

}  // namespace
}  // namespace helio::test
