// Jobs that outlive their daemon: one that stops, and one that is killed.
#include <signal.h>

#include <filesystem>
#include <random>
#include <thread>

#include "../daemon_process.h"
#include "kept_jobs_fixture.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

struct Case {
  const char* name;
  std::function<void(pb::RunJobRequest&)> change;
};

// What checkpoints hold differs between these.
std::vector<Case> cases() {
  const auto with = [](pb::Mode mode, pb::Integrator integrator) {
    return [=](pb::RunJobRequest& job) {
      job.mutable_settings()->set_mode(mode);
      job.mutable_settings()->set_integrator(integrator);
    };
  };
  const auto to_error = [](std::function<void(pb::RunJobRequest&)> change, double error) {
    return [=](pb::RunJobRequest& job) {
      change(job);
      job.mutable_budget()->set_samples(0);
      job.mutable_budget()->set_error(error);
    };
  };
  const auto pt = with(pb::MODE_PT, pb::INTEGRATOR_PATH), adaptive = with(pb::MODE_ADAPTIVE, pb::INTEGRATOR_PATH);
  return {
      {"pt", pt},
      {"pt_error", to_error(pt, 0.004)},
      {"adaptive", adaptive},
      {"adaptive_error", to_error(adaptive, 0.004)},
      {"pt_bdpt", with(pb::MODE_PT, pb::INTEGRATOR_PT_BDPT)},
      {"lvc",
       [=](pb::RunJobRequest& job) {
         with(pb::MODE_PT, pb::INTEGRATOR_LVC)(job);
         job.mutable_budget()->set_samples(128);
       }},
      {"camera_path",
       [=](pb::RunJobRequest& job) {
         pt(job);
         job.mutable_budget()->set_samples(256);
         for (int i = 0; i < 3; ++i) {
           pb::CameraView& view = *job.add_views();
           view.mutable_position()->set_x(278 + 40 * i);
           view.mutable_position()->set_y(273);
           view.mutable_position()->set_z(-800);
           view.mutable_look_at()->mutable_target()->set_x(278);
           view.mutable_look_at()->mutable_target()->set_y(273);
         }
       }},
  };
}

// The daemon is another process.
class KilledDaemonTest : public KeptJobsTest {
 protected:
  void spawn() {
    fs::create_directories(folder_ / "out");
    daemon_ = std::make_unique<DaemonProcess>(
        std::vector<std::string>{"--log-level", "error", "--render-threads", "2", "--checkpoint-interval", "0.02",
                                 "--state", folder_ / "state"});
    ASSERT_FALSE(daemon_->address().empty());
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = pb::RenderService::NewStub(
        grpc::CreateCustomChannel(daemon_->address(), grpc::InsecureChannelCredentials(), own));
  }
  // The pictures of every view.
  std::vector<std::string> results(const pb::Job& job) {
    std::vector<std::string> files;
    for (std::uint32_t view = 0; view < job.views(); ++view) files.push_back(result(job.job_id(), view));
    return files;
  }

  std::unique_ptr<DaemonProcess> daemon_;
};
class KilledJobTest : public KilledDaemonTest, public testing::WithParamInterface<std::size_t> {};

// Killed at any moment, a job ends in the files, to the last byte, that it would have written undisturbed.
TEST_P(KilledJobTest, EndsInTheBitsOfAnUndisturbedOne) {
  const Case which = cases()[GetParam()];
  spawn();
  const std::string scene = load_scene();
  pb::SubmitJobRequest asked = request(scene, 64, 1024);
  which.change(*asked.mutable_job());
  const std::string whole = submitted(asked);
  const pb::Job undisturbed = wait_for(whole, pb::JOB_STATE_SUCCEEDED);
  ASSERT_EQ(undisturbed.state(), pb::JOB_STATE_SUCCEEDED) << undisturbed.reason();
  const auto expected = results(undisturbed);
  const double seconds = undisturbed.ended_s() - undisturbed.started_s();

  std::mt19937 random(std::uint32_t(GetParam() + 1));
  const std::string id = submitted(asked);
  const int kills = full_tier() ? 20 : 3;
  int interrupted = 0, with_checkpoint = 0;
  for (int i = 0; i < kills; ++i) {
    // Spread over what is left of it.
    const double share = std::uniform_real_distribution<double>(0.05, 0.6)(random);
    std::this_thread::sleep_for(std::chrono::duration<double>(share * seconds / (full_tier() ? 6 : 2)));
    interrupted += job(id).state() < pb::JOB_STATE_SUCCEEDED ? 1 : 0;
    daemon_->signal(SIGKILL);
    daemon_->wait();
    with_checkpoint += fs::exists(folder_ / ("state/checkpoints/" + id + ".a")) ? 1 : 0;
    spawn();
  }
  EXPECT_GT(interrupted, 0) << "every kill came after the end";
  EXPECT_GT(with_checkpoint, 0) << "every attempt began with nothing";
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  ASSERT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_TRUE(done.same_bits());
  EXPECT_TRUE(results(done) == expected) << "the files differ after " << done.attempt() << " attempts";
}

INSTANTIATE_TEST_SUITE_P(All, KilledJobTest, testing::Range<std::size_t>(0, 7),
                         [](const auto& info) { return std::string(cases()[info.param].name); });

// A daemon that stops takes a checkpoint of what runs, and the next one goes on: by upload and by an edit of it.
TEST_F(KeptJobsTest, ARestartGoesOnWithScenesThatWereUploadedAndEdited) {
  start_daemon();
  const std::string loaded = load_scene();
  pb::EditSceneRequest edit;
  edit.set_scene_id(loaded);
  edit.add_edits()->mutable_material()->set_index(0);
  edit.mutable_edits(0)->mutable_material()->mutable_base_color()->set_x(0.3);
  pb::EditSceneResponse edited;
  const grpc::Status status = call(&pb::RenderService::Stub::EditScene, edit, &edited);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const std::string whole = submitted(request(edited.scene().scene_id(), 32, 4096));
  wait_for(whole, pb::JOB_STATE_SUCCEEDED);
  const std::string id = submitted(request(edited.scene().scene_id(), 32, 4096));
  wait_for_samples(id, 2);
  restart();
  const pb::Job done = wait_for(id, pb::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), pb::JOB_STATE_SUCCEEDED) << done.reason();
  EXPECT_EQ(done.attempt(), 2u);
  EXPECT_TRUE(result(id) == result(whole));
  const auto told = events(id);
  ASSERT_EQ(told.size(), 5u);
  EXPECT_EQ(told[2].to(), pb::JOB_STATE_QUEUED);
  EXPECT_NE(told[2].reason().find("stopped"), std::string::npos) << told[2].reason();
}

TEST_F(KeptJobsTest, AChangedSceneFileFailsTheJobByName) {
  start_daemon([](ServerConfig& config) { config.max_jobs = 0; });
  write_file(folder_ / "quad.gltf", quad_gltf(1));
  pb::LoadSceneRequest begin;
  begin.mutable_begin()->set_path("quad.gltf");
  pb::LoadSceneResponse loaded;
  const grpc::Status status = load({begin}, &loaded);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const std::string id = submitted(request(loaded.scene().scene_id(), 16, 4));
  write_file(folder_ / "quad.gltf", quad_gltf(2));
  restart();
  const pb::Job failed = wait_for(id, pb::JOB_STATE_FAILED);
  EXPECT_EQ(failed.state(), pb::JOB_STATE_FAILED);
  EXPECT_NE(failed.reason().find("quad.gltf"), std::string::npos) << failed.reason();
}

// SIGTERM ends a daemon with a job in hand well within its grace, with exit code 0.
TEST_F(KilledDaemonTest, SigtermSavesWhatRuns) {
  spawn();
  const std::string id = submitted(request(load_scene(), 64, 1u << 30));
  wait_for_samples(id, 16);
  const auto reached = job(id).progress().samples_per_pixel();
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
  spawn();
  ASSERT_TRUE(eventually([&] { return job(id).attempt() == 2u && job(id).progress().samples_per_second() > 0; }));
  EXPECT_GE(job(id).progress().samples_per_pixel(), reached);
}

}  // namespace
}  // namespace helio::test
