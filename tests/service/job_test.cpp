// RunJob and CancelJob.
#include "renderer/base/clock.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class JobTest : public ServiceTest {
 protected:
  struct Outcome {
    std::vector<pb::RunJobResponse> messages;
    grpc::Status status;
  };
  Outcome run(const pb::RunJobRequest& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    auto reader = stub().RunJob(&context, request);
    Outcome outcome;
    pb::RunJobResponse response;
    while (reader->Read(&response)) outcome.messages.push_back(response);
    outcome.status = reader->Finish();
    return outcome;
  }
  pb::RunJobRequest request(int width, int height, std::uint32_t samples) {
    pb::RunJobRequest request;
    request.set_scene_id(scene_);
    request.mutable_settings()->set_width(width);
    request.mutable_settings()->set_height(height);
    request.mutable_budget()->set_samples(samples);
    return request;
  }
  void start_with_scene(const std::function<void(ServerConfig&)>& change = {}) {
    start(change);
    scene_ = load_quad();
  }

  std::string scene_;
};

TEST_F(JobTest, AcceptedTilesResult) {
  start_with_scene();
  const Outcome outcome = run(request(200, 100, 6));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  ASSERT_TRUE(outcome.messages.front().has_accepted());
  EXPECT_EQ(outcome.messages.front().accepted().settings().roulette_from(), 3);
  const std::string id = outcome.messages.front().accepted().job_id();
  ASSERT_TRUE(outcome.messages.back().has_result());
  const pb::RunJobResponse::Result& result = outcome.messages.back().result();
  EXPECT_EQ(result.job_id(), id);
  EXPECT_EQ(result.end().reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(result.end().totals().samples_per_pixel(), 6u);
  std::int64_t pixels = 0;
  for (const auto& message : outcome.messages) {
    if (!message.has_tile()) continue;
    EXPECT_TRUE(message.tile().final());
    EXPECT_TRUE(message.tile().tag().session_id().empty());
    const pb::Rect& w = message.tile().window();
    pixels += std::int64_t(w.x1() - w.x0()) * (w.y1() - w.y0());
  }
  EXPECT_EQ(pixels, 200 * 100);
}

TEST_F(JobTest, PreviewTilesComeOnTheWay) {
  start_with_scene();
  pb::RunJobRequest job = request(64, 64, 64);
  job.set_preview_tiles(true);
  const Outcome outcome = run(job);
  ASSERT_TRUE(outcome.status.ok());
  bool preview = false, final = false;
  for (const auto& message : outcome.messages) {
    if (message.has_tile()) (message.tile().final() ? final : preview) = true;
  }
  EXPECT_TRUE(preview);
  EXPECT_TRUE(final);
}

TEST_F(JobTest, ProgressComesAboutFourTimesASecond) {
  start_with_scene();
  pb::RunJobRequest job = request(128, 128, 0);
  job.mutable_budget()->set_time_s(1.1);
  const Outcome outcome = run(job);
  int progress = 0;
  for (const auto& message : outcome.messages) progress += message.has_progress();
  EXPECT_GE(progress, 2);
  EXPECT_LE(progress, 5);
  EXPECT_EQ(outcome.messages.back().result().end().reason(), pb::END_REASON_TIME);
}

TEST_F(JobTest, SameSeedGivesTheSameBytes) {
  start_with_scene();
  const auto pixels = [&](std::uint64_t seed) {
    pb::RunJobRequest job = request(100, 100, 3);
    job.mutable_settings()->set_seed(seed);
    job.mutable_camera()->set_scene_camera("front");
    std::map<std::string, std::string> tiles;
    for (const auto& message : run(job).messages) {
      if (message.has_tile()) tiles[message.tile().window().ShortDebugString()] = message.tile().exr();
    }
    return tiles;
  };
  const auto first = pixels(1);
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(first, pixels(1));
  EXPECT_NE(first, pixels(2)) << "edge pixels depend on the seed";
}

TEST_F(JobTest, BadRequestsNameEveryField) {
  start_with_scene();
  pb::RunJobRequest bad;
  bad.mutable_settings()->set_width(-1);
  bad.mutable_format()->set_pixel_type(pb::PixelType(4));
  expect_status(run(bad).status, StatusCode::INVALID_ARGUMENT,
                {"scene_id: 0 bytes", "settings.width", "budget: has no end", "format.pixel_type: unknown value 4"});
  pb::RunJobRequest camera = request(8, 8, 1);
  camera.mutable_camera()->mutable_position()->set_x(std::numeric_limits<double>::quiet_NaN());
  expect_status(run(camera).status, StatusCode::INVALID_ARGUMENT, {"camera.position", "nan", "camera", "look_at"});
  pb::RunJobRequest unknown = request(8, 8, 1);
  unknown.set_scene_id("nothing");
  expect_status(run(unknown).status, StatusCode::NOT_FOUND, {"scene_id", "nothing"});
  pb::RunJobRequest large = request(60000, 60000, 1);
  expect_status(run(large).status, StatusCode::RESOURCE_EXHAUSTED, {"max_film_pixels"});
  EXPECT_TRUE(run(request(8, 8, 1)).status.ok());
}

TEST_F(JobTest, CancelJobEndsWithItsResult) {
  start_with_scene();
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, request(256, 256, 1 << 30));
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  pb::CancelJobRequest cancel;
  pb::CancelJobResponse cancelled;
  cancel.set_job_id(response.accepted().job_id());
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  ASSERT_TRUE(call(&pb::RenderService::Stub::CancelJob, cancel, &cancelled).ok());
  while (reader->Read(&response)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_TRUE(response.has_result());
  EXPECT_EQ(response.result().end().reason(), pb::END_REASON_CANCELLED);
  EXPECT_TRUE(eventually([&] {
    return call(&pb::RenderService::Stub::CancelJob, cancel, &cancelled).error_code() == StatusCode::NOT_FOUND;
  }));
}

TEST_F(JobTest, CancelRightAfterTheStartCounts) {
  start_with_scene();
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
    auto reader = stub().RunJob(&context, request(256, 256, 1 << 30));
    pb::RunJobResponse response;
    ASSERT_TRUE(reader->Read(&response));
    pb::CancelJobRequest cancel;
    pb::CancelJobResponse cancelled;
    cancel.set_job_id(response.accepted().job_id());
    ASSERT_TRUE(call(&pb::RenderService::Stub::CancelJob, cancel, &cancelled).ok());
    while (reader->Read(&response)) {
    }
    const grpc::Status status = reader->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_TRUE(response.has_result());
    EXPECT_EQ(response.result().end().reason(), pb::END_REASON_CANCELLED);
  }
}

TEST_F(JobTest, CancelledCallFreesItsPlaceAndItsScene) {
  start_with_scene([](ServerConfig& config) { config.max_jobs = 1; });
  {
    grpc::ClientContext context;
    auto reader = stub().RunJob(&context, request(256, 256, 1 << 30));
    pb::RunJobResponse response;
    ASSERT_TRUE(reader->Read(&response));
    expect_status(run(request(8, 8, 1)).status, StatusCode::RESOURCE_EXHAUSTED, {"max_jobs", "1"});
    context.TryCancel();
    while (reader->Read(&response)) {
    }
    EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
  }
  EXPECT_TRUE(eventually([&] { return run(request(8, 8, 1)).status.ok(); }));
  pb::UnloadSceneRequest unload;
  pb::UnloadSceneResponse unloaded;
  unload.set_scene_id(scene_);
  EXPECT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }));
}

TEST_F(JobTest, InteractiveSessionsComeFirst) {
  start_with_scene();
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, request(256, 256, 1 << 30));
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  const std::string session = create_session(scene_, 128, 128, 16);
  StreamClient client(stub(), session);
  client.send(view(1));
  EXPECT_TRUE(client.reader().wait_for_frame_end(1)) << "a job in hand does not starve a session";
  context.TryCancel();
}

}  // namespace
}  // namespace helio::test
