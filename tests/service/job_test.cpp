// RunJob and CancelJob.
#include <algorithm>
#include <set>

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
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
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

// A stream's frames and a job alike say what the integrator leaves out of the scene.
TEST_F(JobTest, WhatIsNotSampledIsToldWithThePicture) {
  start_with_scene();
  EXPECT_EQ(run(request(8, 8, 2)).messages.front().accepted().unsampled_size(), 0);
  Upload upload;
  upload.bytes = spotlit_mirror_gltf();
  pb::LoadSceneResponse loaded;
  ASSERT_TRUE(load(upload.messages(), &loaded).ok());
  scene_ = loaded.scene().scene_id();
  std::set<std::string> first;
  for (const auto integrator : {pb::INTEGRATOR_PATH, pb::INTEGRATOR_BDPT, pb::INTEGRATOR_VCM}) {
    pb::RunJobRequest job = request(8, 8, 2);
    job.mutable_settings()->set_integrator(integrator);
    const Outcome outcome = run(job);
    ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    const auto& accepted = outcome.messages.front().accepted();
    ASSERT_GT(accepted.unsampled_size(), 0);
    EXPECT_TRUE(first.insert(accepted.unsampled(0)).second) << accepted.unsampled(0);

    pb::CreateSessionRequest create_request;
    create_request.set_scene_id(scene_);
    *create_request.mutable_settings() = job.settings();
    create_request.mutable_budget()->set_samples(2);
    pb::CreateSessionResponse session;
    ASSERT_TRUE(create(create_request, &session).ok());
    StreamClient client(stub(), session.session_id());
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    const auto messages = client.reader().messages();
    ASSERT_TRUE(messages[1].has_frame_begin());
    const auto& begin = messages[1].frame_begin();
    EXPECT_EQ(std::vector<std::string>(begin.unsampled().begin(), begin.unsampled().end()),
              std::vector<std::string>(accepted.unsampled().begin(), accepted.unsampled().end()));
  }
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
  pb::RunJobRequest moving = request(8, 8, 1);
  moving.mutable_settings()->set_preview_rate(20);
  expect_status(run(moving).status, StatusCode::INVALID_ARGUMENT, {"settings.preview_rate", "20"});
  pb::RunJobRequest camera = request(8, 8, 1);
  camera.mutable_camera()->mutable_position()->set_x(std::numeric_limits<double>::quiet_NaN());
  expect_status(run(camera).status, StatusCode::INVALID_ARGUMENT, {"camera.position", "nan", "camera", "look_at"});
  pb::RunJobRequest three = camera;
  three.mutable_settings()->set_width(-1);
  three.mutable_format()->set_pixel_type(pb::PixelType(4));
  expect_status(run(three).status, StatusCode::INVALID_ARGUMENT,
                {"camera.position", "settings.width", "format.pixel_type"});
  three.set_scene_id("nothing");
  expect_status(run(three).status, StatusCode::INVALID_ARGUMENT,
                {"camera.position", "settings.width", "format.pixel_type", "scene_id: there is no scene 'nothing'"});
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
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
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

// What came of each view of a path, by its index.
struct ViewOutcome {
  std::map<std::string, std::string> tiles;  // final ones: window -> EXR
  pb::FrameEnd end;
};
std::vector<ViewOutcome> by_view(const std::vector<pb::RunJobResponse>& messages) {
  std::vector<ViewOutcome> views(1);
  for (const auto& message : messages) {
    if (message.has_tile()) {
      EXPECT_EQ(message.tile().tag().view_id(), views.size());
      if (message.tile().final()) views.back().tiles[message.tile().window().ShortDebugString()] = message.tile().exr();
    }
    if (message.has_progress()) {
      EXPECT_EQ(message.progress().tag().view_id(), views.size());
    }
    if (message.has_view_result()) {
      EXPECT_EQ(message.view_result().view() + 1, views.size());
      views.back().end = message.view_result().end();
      views.emplace_back();
    }
    if (message.has_result()) {
      EXPECT_EQ(message.result().view() + 1, views.size());
      views.back().end = message.result().end();
    }
  }
  return views;
}

TEST_F(JobTest, EachViewOfAPathIsTheStillFromThere) {
  start_with_scene();
  const double places[] = {0, 0.4, 0.4, -1.5};  // the third view repeats the second
  pb::RunJobRequest path = request(200, 100, 6);
  for (const double x : places) *path.add_views() = view(1, x).camera();
  path.add_views()->set_scene_camera("front");
  const Outcome outcome = run(path);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.messages.front().accepted().views(), 5u);
  ASSERT_TRUE(outcome.messages.back().has_result());
  EXPECT_EQ(outcome.messages.back().result().job_id(), outcome.messages.front().accepted().job_id());
  const std::vector<ViewOutcome> views = by_view(outcome.messages);
  ASSERT_EQ(views.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    SCOPED_TRACE("view " + std::to_string(i));
    pb::RunJobRequest still = request(200, 100, 6);
    *still.mutable_camera() = path.views(i);
    const std::vector<ViewOutcome> alone = by_view(run(still).messages);
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_EQ(views[i].end.reason(), pb::END_REASON_SAMPLES);
    EXPECT_EQ(views[i].end.totals().samples_per_pixel(), 6u);
    EXPECT_FALSE(alone[0].tiles.empty());
    EXPECT_EQ(views[i].tiles, alone[0].tiles);
  }
  EXPECT_NE(views[0].tiles, views[1].tiles);
}

TEST_F(JobTest, EveryBadViewOfAPathIsNamed) {
  start_with_scene();
  pb::RunJobRequest bad = request(8, 8, 1);
  *bad.mutable_camera() = view(1).camera();
  bad.mutable_settings()->set_height(-2);
  bad.mutable_format()->set_compression(pb::Compression(99));
  *bad.add_views() = view(1).camera();
  bad.add_views()->set_scene_camera("rear");
  *bad.add_views() = view(1).camera();
  bad.mutable_views(2)->set_lens_radius(-1);
  expect_status(run(bad).status, StatusCode::INVALID_ARGUMENT,
                {"camera: is given beside views", "settings.height: -2", "format.compression: unknown value 99",
                 "views[1].scene_camera: 'rear'", "views[2].lens_radius: -1"});
  pb::RunJobRequest many = request(8, 8, 1);
  for (int i = 0; i <= 10000; ++i) many.add_views()->set_scene_camera("0");
  expect_status(run(many).status, StatusCode::INVALID_ARGUMENT, {"views: 10001 views; allowed: at most 10000"});
}

// Cancels by id when the first view is done, or soon after: in a view or between two.
TEST_F(JobTest, APathIsCancelledWhereverItIs) {
  start_with_scene();
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    pb::RunJobRequest path = request(64, 64, 1);
    for (int k = 0; k < 10000; ++k) *path.add_views() = view(1, 0.0001 * k).camera();
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    auto reader = stub().RunJob(&context, path);
    pb::RunJobResponse response;
    std::vector<pb::RunJobResponse> messages;
    while (reader->Read(&response)) {
      messages.push_back(response);
      if (!response.has_view_result() || response.view_result().view() != 0) continue;
      std::this_thread::sleep_for(std::chrono::microseconds(300 * i));
      pb::CancelJobRequest cancel;
      pb::CancelJobResponse cancelled;
      cancel.set_job_id(messages.front().accepted().job_id());
      ASSERT_TRUE(call(&pb::RenderService::Stub::CancelJob, cancel, &cancelled).ok());
    }
    const grpc::Status status = reader->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_TRUE(messages.back().has_result());
    EXPECT_EQ(messages.back().result().end().reason(), pb::END_REASON_CANCELLED);
    const auto results =
        std::count_if(messages.begin(), messages.end(), [](const auto& message) { return message.has_result(); });
    EXPECT_EQ(results, 1);
    EXPECT_LT(by_view(messages).size(), 10000u);
  }
  pb::UnloadSceneRequest unload;
  pb::UnloadSceneResponse unloaded;
  unload.set_scene_id(scene_);
  EXPECT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }));
}

TEST_F(JobTest, ACallerWhoGivesUpEndsThePath) {
  start_with_scene([](ServerConfig& config) { config.max_jobs = 1; });
  pb::RunJobRequest path = request(64, 64, 1);
  for (int k = 0; k < 10000; ++k) *path.add_views() = view(1, 0.0001 * k).camera();
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, path);
  pb::RunJobResponse response;
  while (reader->Read(&response) && !response.has_view_result()) {
  }
  context.TryCancel();
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
  EXPECT_TRUE(eventually([&] { return run(request(8, 8, 1)).status.ok(); }));
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
