// A kept job's life (submitted, its scene loaded again, begun, a checkpoint, paused, resumed, finished) without gRPC,
// once for each of its allocations, or for some of them, which fails. The job comes to an end that can be told, or waits
// in the queue; the daemon lives, and nothing of the job stays behind.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <thread>

#include "renderer/base/clock.h"
#include "renderer/codec/sha256.h"
#include "server/base/guarded.h"
#include "server/jobs/durable_jobs.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;
namespace fs = std::filesystem;

// A square that shines, and a camera before it.
constexpr char kScene[] = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"mesh": 0}, {"camera": 0, "name": "front", "translation": [0, 0, 3]}],
 "cameras": [{"name": "front", "type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
 "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 1, 1]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
   {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
 "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAPwAAgD8AAAAAAACAvwAAgD8AAAAAAAABAAIAAAACAAMA"}]})";

class FailedJobAllocations : public testing::Test {
 protected:
  FailedJobAllocations() {
    spdlog::set_level(spdlog::level::off);
    std::string pattern = (fs::temp_directory_path() / "helio-jobs-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    ServerConfig config;
    config.max_jobs = 1;
    config.render_threads = 2;
    config.checkpoint_interval_s = 0.001;
    config.max_memory = 1ull << 30;
    core_.emplace(complete(config), *SceneRoots::open({}));
    std::vector<std::string> notices;
    auto jobs = DurableJobs::open(*core_, folder_ + "/state", notices);
    EXPECT_TRUE(jobs.ok()) << jobs.error().to_string();
    jobs_ = std::move(*jobs);
    jobs_->begin();
    request_.mutable_job()->mutable_settings()->set_width(8);
    request_.mutable_job()->mutable_settings()->set_height(8);
    request_.mutable_job()->mutable_budget()->set_samples(512);
    for (const double x : {0.0, 0.1}) {
      pb::CameraView& view = *request_.mutable_job()->add_views();
      view.mutable_position()->set_x(x);
      view.mutable_position()->set_z(3);
      view.mutable_look_at()->mutable_target();
    }
  }
  ~FailedJobAllocations() override {
    jobs_.reset();
    fs::remove_all(folder_);
  }

  // As a client that uploads it.
  void load_scene() {
    SceneBundle bundle;
    bundle.main_file = "quad.gltf";
    const std::string gltf = kScene;
    bundle.files.push_back({bundle.main_file, {gltf.begin(), gltf.end()}});
    Sha256 hash;
    hash.update(gltf);
    bundle.digests[bundle.main_file] = hash.finish();
    EXPECT_EQ(jobs_->keep_upload(bundle), "");
    SceneRequest request;
    request.files = std::move(bundle);
    const auto loaded = core_->scenes.load(std::move(request), CancelToken());
    ASSERT_TRUE(loaded.ok()) << loaded.error().to_string();
    request_.mutable_job()->set_scene_id(loaded->scene->id);
  }

  // Waits without allocations that count, until the job is so; hangs end after a minute.
  JobRecord wait_until(const std::string& id, const std::function<bool(const JobRecord&)>& is_so) {
    const ExemptFromFailing exempt;
    for (int i = 0; i < 60'000; ++i) {
      const auto job = jobs_->table().get(id);
      if (job && is_so(*job)) return *job;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const auto job = jobs_->table().get(id);
    ADD_FAILURE() << id << " is stuck: " << (job ? to_string(job->state) : "gone");
    return job ? *job : JobRecord();
  }
  static bool is_told(const JobRecord& job) {
    return is_final(job.state) || (job.state != JobState::running && !job.reason.empty());
  }

  struct Life {
    std::optional<Error> refused;  // a call that failed
    std::string reason;            // of a job that did not come to its end by itself
  };

  // Its allocation of this number fails; 0: none.
  Life live(std::uint64_t failing) {
    load_scene();
    const std::string name = "life " + std::to_string(++lives_);
    request_.set_name(name);
    Life life;
    std::string id;
    {
      // Nothing begins while the place is taken: the job finds its scene gone.
      const auto place = core_->jobs.reserve();
      EXPECT_TRUE(place.ok());
      const FailingAllocations allocations(failing);
      const auto submitted = guarded([&] { return jobs_->submit(request_, Caller{}, "test"); });
      if (submitted) {
        const ExemptFromFailing exempt;
        id = submitted->job().job_id();
      } else {
        life.refused = submitted.error();
      }
      {
        const ExemptFromFailing exempt;
        unload_scenes();
        core_->jobs.remove(*place);
      }
      if (!id.empty()) {
        JobRecord job = wait_until(id, [&](const JobRecord& now) {
          return is_told(now) || (now.state == JobState::running && now.views_done > 0);
        });
        if (job.state == JobState::running) {
          const auto paused = guarded([&] { return jobs_->pause(id, "test"); });
          if (!paused) life.refused = paused.error();
          if (paused) job = wait_until(id, [](const JobRecord& now) { return now.state != JobState::running; });
        }
        if (job.state == JobState::paused && job.reason.empty()) {
          const auto resumed = guarded([&] { return jobs_->resume(id, "test"); });
          if (!resumed) life.refused = resumed.error();
          if (resumed) job = wait_until(id, is_told);
        }
      }
      seen_ = allocations.seen();
    }
    end(id, name, life);
    return life;
  }

  // What did not come to its end is cancelled; afterwards nothing of it is there.
  void end(std::string id, const std::string& name, Life& life) {
    const auto listed = jobs_->list(pb::ListJobsRequest());
    ASSERT_TRUE(listed.ok());
    // One that was submitted, though its caller was told otherwise: a client token would have told it apart.
    if (id.empty() && listed->jobs_size() > 0 && listed->jobs(0).name() == name) id = listed->jobs(0).job_id();
    if (!id.empty()) {
      const auto job = jobs_->table().get(id);
      ASSERT_TRUE(job.ok());
      if (job->state != JobState::succeeded) life.reason = job->reason;
      if (!is_final(job->state)) {
        (void)jobs_->cancel(id, "test");
        wait_until(id, [](const JobRecord& now) { return is_final(now.state); });
      } else if (job->state == JobState::succeeded) {
        EXPECT_EQ(job->views_done, 2u);
      } else {
        EXPECT_FALSE(job->reason.empty()) << "failed without a reason";
      }
    }
    // The place is given back after the row is written.
    for (int i = 0; i < 10'000 && !core_->jobs.wait_until_empty(now_s()); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(core_->jobs.wait_until_empty(now_s())) << "a place is held";
    unload_scenes();
    core_->reaper.wait_until_idle();
    // The scheduler lets go of the attempt a little later.
    for (int i = 0; i < 10'000 && core_->memory.used() > 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(core_->memory.used(), 0u);
    EXPECT_TRUE(fs::is_empty(folder_ + "/state/checkpoints"));
    EXPECT_TRUE(fs::is_empty(folder_ + "/state/scenes/recipes"));
  }

  void unload_scenes() {
    for (const auto& scene : core_->scenes.list()) {
      Status done = core_->scenes.unload(scene->id, "");
      for (int i = 0; i < 10'000 && !done.ok(); ++i) {  // a job that has ended lets go of it
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        done = core_->scenes.unload(scene->id, "");
      }
      EXPECT_TRUE(done.ok()) << done.error().to_string();
    }
  }

  std::string folder_;
  pb::SubmitJobRequest request_;
  std::optional<ServiceCore> core_;
  std::unique_ptr<DurableJobs> jobs_;
  std::uint64_t seen_ = 0;  // allocations of the newest life
  int lives_ = 0;
};

TEST_F(FailedJobAllocations, EndAJobOrARequestAndNothingElse) {
  for (int i = 0; i < 3; ++i) {  // what is made once is made
    const Life life = live(0);
    ASSERT_FALSE(life.refused) << life.refused->to_string();
    ASSERT_EQ(life.reason, "");
  }
  const std::uint64_t in_a_life = seen_, most = by_tier<std::uint64_t>(150, in_a_life);
  ASSERT_GE(in_a_life, most);
  int refused = 0, told = 0, lives = 0;
  // Each of the first ones, which are of submit(), then as many, spread over the rest; in the full tier all.
  const std::uint64_t stride = in_a_life / most;
  for (std::uint64_t fails = 1; fails <= in_a_life; fails += fails < most ? 1 : stride) {
    const Life life = live(fails);
    ++lives;
    refused += life.refused ? 1 : 0;
    told += life.reason.empty() ? 0 : 1;
    ASSERT_FALSE(HasFailure()) << "allocation " << fails << " of " << in_a_life;
  }
  std::printf("%llu allocations in a life; of %d lives %d had a call that was refused, %d a job that told of it\n",
              static_cast<unsigned long long>(in_a_life), lives, refused, told);
  EXPECT_GT(refused, 10);
  EXPECT_GT(told, 10);
  const Life life = live(0);
  EXPECT_FALSE(life.refused);
  EXPECT_EQ(life.reason, "");
}

}  // namespace
}  // namespace helio::test
