// A daemon under many sessions that open, move and close, and among them clients that behave badly: everyone who behaves
// is served, nothing stays behind, and two owners of sessions share the machine.
//
// The full tier has 200 sessions and 20 bad clients for ten minutes; the short tier is the same with fewer, for seconds.
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <random>

#include "../jobs/kept_jobs_fixture.h"
#include "bad_clients.h"
#include "renderer/base/clock.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
using Random = std::mt19937;

constexpr int kOwners = 2;

int between(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * std::uint64_t(sysconf(_SC_PAGESIZE));
}

std::uint64_t resident_after_trim() {
  malloc_trim(0);
  return resident_bytes();
}

// What everyone who behaves has done.
struct Work {
  std::atomic<int> sessions = 0, views = 0, jobs = 0, cancelled_jobs = 0;
  std::mutex mutex;
  std::vector<std::string> failures;     // with mutex
  std::map<std::string, int> owner_of;   // sessions' owners; with mutex

  void fail(const std::string& what, const grpc::Status& status) {
    const std::lock_guard lock(mutex);
    failures.push_back(what + ": " + std::to_string(status.error_code()) + " " + status.error_message());
  }
};

// One of an owner's users: opens a session, moves the camera, changes the size, leaves and comes back, closes.
class User {
 public:
  User(pb::RenderService::Stub& stub, std::string scene_id, int owner, std::uint32_t seed, Work& work)
      : stub_(stub), scene_id_(std::move(scene_id)), owner_(owner), random_(seed), work_(work) {}

  void live(const std::atomic<bool>& stop) {
    for (int i = 0; !stop; ++i) {
      if (i % 2 == 1) {
        run_job();
      } else if (!session()) {
        return;
      }
    }
  }

 private:
  std::unique_ptr<grpc::ClientContext> context() {
    auto context = std::make_unique<grpc::ClientContext>();
    // Ends what hangs: each of the sessions gets its turn within it on any machine.
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(300 * kPatience));
    return context;
  }
  pb::RenderSettings settings() {
    pb::RenderSettings settings;
    settings.set_width(std::uint32_t(between(random_, 16, 48)));
    settings.set_height(std::uint32_t(between(random_, 16, 48)));
    settings.set_mode(pb::Mode(between(random_, pb::MODE_PT, pb::MODE_COMBINED)));
    return settings;
  }
  bool failed(const std::string& what, const grpc::Status& status) {
    work_.fail(what, status);
    return false;
  }

  bool session() {
    pb::CreateSessionRequest create;
    create.set_scene_id(scene_id_);
    *create.mutable_settings() = settings();
    create.mutable_budget()->set_samples(std::uint32_t(between(random_, 1, 8)));
    pb::CreateSessionResponse created;
    const grpc::Status status = stub_.CreateSession(context().get(), create, &created);
    if (!status.ok()) return failed("CreateSession", status);
    ++work_.sessions;
    {
      const std::lock_guard lock(work_.mutex);
      work_.owner_of[created.session_id()] = owner_;
    }
    view_id_ = 0;
    for (int streams = between(random_, 1, 3); streams > 1; --streams) {
      if (!stream(created.session_id(), false)) return false;
    }
    const bool by_stream = between(random_, 0, 1) == 0;
    if (!stream(created.session_id(), by_stream)) return false;
    if (by_stream) return true;
    pb::CloseSessionRequest close;
    close.set_session_id(created.session_id());
    pb::CloseSessionResponse closed;
    const grpc::Status over = stub_.CloseSession(context().get(), close, &closed);
    return over.ok() || failed("CloseSession", over);
  }

  bool stream(const std::string& id, bool close) {
    const auto call = context();
    const auto stream = stub_.StreamFrames(call.get());
    pb::StreamRequest request;
    request.mutable_open()->set_session_id(id);
    stream->Write(request);
    for (int moves = between(random_, 1, 5); moves > 0; --moves) {
      if (between(random_, 0, 4) == 0) {
        *request.mutable_settings() = settings();
        stream->Write(request);
      }
      // Of views that come at once the last one is rendered.
      for (int burst = between(random_, 1, 3); burst > 0; --burst) {
        *request.mutable_view() = view(++view_id_, std::uniform_real_distribution<double>(-0.5, 0.5)(random_));
        stream->Write(request);
      }
      pb::StreamResponse response;
      bool ended = false;
      while (!ended && stream->Read(&response))
        ended = response.has_frame_end() && response.frame_end().tag().view_id() == view_id_;
      if (!ended) return failed("a view", stream->Finish());
      ++work_.views;
    }
    if (between(random_, 0, 3) == 0 && !close) {  // leaves without a word
      call->TryCancel();
      stream->Finish();
      return true;
    }
    request.mutable_close()->set_close_session(close);
    stream->Write(request);
    stream->WritesDone();
    pb::StreamResponse response;
    while (stream->Read(&response)) {
    }
    const grpc::Status status = stream->Finish();
    return status.ok() || failed("the end of a stream", status);
  }

  // A job of the call, or one that is kept; some of them are cancelled.
  void run_job() {
    pb::RunJobRequest job;
    job.set_scene_id(scene_id_);
    job.mutable_settings()->set_width(16);
    job.mutable_settings()->set_height(16);
    job.mutable_budget()->set_samples(between(random_, 0, 1) == 0 ? 2 : 1u << 30);
    const bool cancel = job.budget().samples() > 2;
    job.set_detach(between(random_, 0, 1) == 0);
    const auto call = context();
    const auto reader = stub_.RunJob(call.get(), job);
    pb::RunJobResponse response;
    bool result = false, asked = false;
    while (reader->Read(&response)) {
      result |= response.has_result();
      if (!cancel || asked || !response.has_accepted()) continue;
      asked = true;
      pb::CancelJobRequest request;
      request.set_job_id(response.accepted().job_id());
      pb::CancelJobResponse cancelled;
      const grpc::Status status = stub_.CancelJob(context().get(), request, &cancelled);
      if (!status.ok()) work_.fail("CancelJob", status);
    }
    const grpc::Status status = reader->Finish();
    // All places may be taken; the answer says when to try again.
    const bool no_place = status.error_code() == StatusCode::RESOURCE_EXHAUSTED &&
                          status.error_message().find("try again in") != std::string::npos;
    if (!status.ok() && !no_place) work_.fail("RunJob", status);
    if (status.ok() && !result) work_.fail("RunJob without a result", status);
    if (result) ++(cancel ? work_.cancelled_jobs : work_.jobs);
  }

  pb::RenderService::Stub& stub_;
  const std::string scene_id_;
  const int owner_;
  Random random_;
  Work& work_;
  std::uint64_t view_id_ = 0;
};

class LoadTest : public KeptJobsTest {
 protected:
  struct Size {
    int sessions, bad_clients;
    double seconds;
  };

  // On a slow machine everyone lives for longer, until each thing has been done once; hangs end after two minutes.
  static bool enough(const Size& size, const Work& work, const BadDeeds& deeds) {
    return work.sessions >= size.sessions && work.views > work.sessions && work.jobs > 0 && work.cancelled_jobs > 0 &&
           deeds.streams > 0 && deeds.vanished > 0 && deeds.rubbish > 0 && deeds.taken_over > 0;
  }
  // Everyone lives for so long; then nobody is there any more. The share of owner 0 in the workers' time.
  double live(const Size& size, const std::string& scene, Work& work, BadDeeds& deeds) {
    std::atomic<bool> stop = false;
    std::vector<std::unique_ptr<pb::RenderService::Stub>> stubs;  // ten sessions a connection, none of two owners
    std::vector<std::unique_ptr<User>> users;
    std::vector<std::thread> threads;
    for (int owner = 0; owner < kOwners; ++owner) {
      for (int i = 0; i < size.sessions / kOwners; ++i) {
        if (i % 10 == 0) stubs.push_back(new_stub());
        // The owners' users do the same.
        users.push_back(std::make_unique<User>(*stubs.back(), scene, owner, std::uint32_t(1 + i), work));
      }
    }
    for (const auto& user : users) threads.emplace_back([&] { user->live(stop); });
    for (int i = 0; i < size.bad_clients; ++i) {
      threads.emplace_back([&, i] {
        behave_badly(BadHabit(i % kBadHabits), server_->address(), scene, std::uint32_t(1000 + i), stop, deeds);
      });
    }
    std::map<std::string, double> used;
    const double end_s = now_s() + size.seconds * kPatience;
    while (now_s() < end_s || (!enough(size, work, deeds) && now_s() < end_s + 120 * kPatience)) {
      look(used);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    stop = true;
    for (std::thread& thread : threads) thread.join();
    double all = 0, first = 0;
    for (const auto& [id, seconds] : used) {
      const auto owner = work.owner_of.find(id);
      if (owner == work.owner_of.end()) continue;  // of a bad client
      all += seconds;
      first += owner->second == 0 ? seconds : 0;
    }
    return first / all;
  }

  // The workers' seconds of each session so far.
  void look(std::map<std::string, double>& used) {
    pb::ListSessionsResponse list;
    const grpc::Status status = call(&pb::RenderService::Stub::ListSessions, pb::ListSessionsRequest(), &list);
    EXPECT_TRUE(status.ok()) << status.error_message();
    for (const pb::SessionInfo& session : list.sessions()) used[session.session_id()] = session.used_seconds();
  }

  int sessions() {
    pb::ListSessionsResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
    return list.sessions_size();
  }
  std::uint64_t unfinished_jobs() {
    pb::ListJobsRequest list;
    for (const pb::JobState state : {pb::JOB_STATE_QUEUED, pb::JOB_STATE_RUNNING, pb::JOB_STATE_PAUSED})
      list.add_states(state);
    pb::ListJobsResponse listed;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListJobs, list, &listed).ok());
    return listed.total();
  }
  // All sessions have ended, by their grace at the latest, all jobs too, and the account is back at `memory`.
  void expect_nobody(std::uint64_t memory) {
    EXPECT_TRUE(eventually([&] { return sessions() == 0; })) << sessions() << " sessions";
    EXPECT_TRUE(eventually([&] { return unfinished_jobs() == 0; })) << unfinished_jobs() << " jobs";
    EXPECT_TRUE(eventually([&] { return server_->memory_used() == memory; }))
        << server_->memory_used() << " bytes are accounted for, before: " << memory;
  }
};

TEST_F(LoadTest, ManySessionsAndBadClientsLeaveNothingBehind) {
  const Size size = by_tier(Size{16, 8, 3}, Size{200, 20, 600});
  start_daemon([&](ServerConfig& config) {
    config.max_sessions = size.sessions + 4 * size.bad_clients;
    config.max_jobs = 8;
    config.request_timeout_s = 5;
    config.max_memory = 4ull << 30;
  });
  spdlog::set_level(spdlog::level::err);  // rubbish is warned of
  const std::string scene = load_quad();
  const std::uint64_t memory = server_->memory_used();
  {
    Work work;
    BadDeeds deeds;
    live({size.sessions, size.bad_clients, by_tier(3.0, 120.0)}, scene, work, deeds);  // what is made once is made
    expect_nobody(memory);
  }
  const std::uint64_t resident = resident_after_trim();

  Work work;
  BadDeeds deeds;
  const double share = live(size, scene, work, deeds);
  expect_nobody(memory);
  const std::uint64_t resident_after = resident_after_trim();
  std::printf("%d sessions, %d views, %d jobs, %d cancelled; bad clients: %d streams, %d vanished, %d times rubbish, %d "
              "taken over; owner 0 had %.1f %%; %.1f MiB resident, before %.1f\n",
              int(work.sessions), int(work.views), int(work.jobs), int(work.cancelled_jobs), int(deeds.streams),
              int(deeds.vanished), int(deeds.rubbish), int(deeds.taken_over), 100 * share,
              double(resident_after) / (1 << 20), double(resident) / (1 << 20));
  EXPECT_TRUE(work.failures.empty()) << work.failures.size() << " failures, the first: " << work.failures[0];
  EXPECT_TRUE(enough(size, work, deeds));
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)  // their allocators keep what is freed
  EXPECT_LE(resident_after, resident + resident / 10);
#endif
  if (full_tier()) {  // what users do differs less, the longer they do it
    EXPECT_GT(share, 0.45);
    EXPECT_LT(share, 0.55);
  }
}

// Two owners with as many sessions on the one arena, all with work: each gets half of the samples.
TEST_F(LoadTest, TwoOwnersShareTheMachine) {
  const int each = by_tier(4, 16);
  start_daemon();
  const std::string scene = load_quad();
  std::vector<std::unique_ptr<pb::RenderService::Stub>> stubs;
  std::vector<std::unique_ptr<StreamClient>> streams;
  std::map<std::string, int> owner_of;
  for (int i = 0; i < each; ++i) {
    for (int owner = 0; owner < kOwners; ++owner) {
      stubs.push_back(new_stub());
      const std::string id = create_session(scene, 48, 48);
      owner_of[id] = owner;
      streams.push_back(std::make_unique<StreamClient>(*stubs.back(), id));
      streams.back()->send(view(1));
    }
  }
  const auto paths = [&] {
    std::map<std::string, double> paths;
    pb::ListSessionsResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
    for (const pb::SessionInfo& session : list.sessions())
      paths[session.session_id()] = double(session.progress().paths());
    return paths;
  };
  for (const auto& stream : streams) ASSERT_TRUE(stream->reader().wait_for_tiles(4));
  const auto before = paths();
  // As many samples as 200 of each pixel of each session.
  const double wanted = 200.0 * 48 * 48 * kOwners * each;
  double of_owner[kOwners] = {};
  EXPECT_TRUE(eventually([&] {
    std::fill(std::begin(of_owner), std::end(of_owner), 0);
    for (const auto& [id, now] : paths()) of_owner[owner_of.at(id)] += now - before.at(id);
    return of_owner[0] + of_owner[1] >= wanted;
  }));
  const double share = of_owner[0] / (of_owner[0] + of_owner[1]);
  std::printf("owner 0 had %.1f %% of %.3g samples\n", 100 * share, of_owner[0] + of_owner[1]);
  EXPECT_GT(share, 0.45);
  EXPECT_LT(share, 0.55);
}

}  // namespace
}  // namespace helio::test
