// Invalid samples from the kernel to the client: counted per tile, frame, session and job, and traced again by token.
#include <cmath>
#include <map>

#include "renderer/base/clock.h"
#include "server/sessions/replay_token.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class ReplayTest : public ServiceTest {
 protected:
  void start_with_overflow() {
    start();
    Upload upload;
    upload.name = "overflow.gltf";
    upload.bytes = overflowing_gltf();
    pb::LoadSceneResponse response;
    const grpc::Status status = load(upload.messages(), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    scene_ = response.scene().scene_id();
  }

  grpc::Status replay(const std::string& token, pb::ReplaySampleResponse* response) {
    pb::ReplaySampleRequest request;
    request.set_token(token);
    return call(&pb::RenderService::Stub::ReplaySample, request, response);
  }

  // Of the final tiles of a view.
  static std::uint64_t invalid_in_tiles(const std::vector<pb::StreamResponse>& messages, std::uint64_t view_id) {
    std::uint64_t invalid = 0;
    for (const auto& message : messages) {
      if (message.has_tile() && message.tile().final() && message.tile().tag().view_id() == view_id)
        invalid += message.tile().invalid_samples();
    }
    return invalid;
  }

  static pb::FrameEnd end_of(const std::vector<pb::StreamResponse>& messages, std::uint64_t view_id) {
    for (const auto& message : messages) {
      if (message.has_frame_end() && message.frame_end().tag().view_id() == view_id) return message.frame_end();
    }
    ADD_FAILURE() << "no end of view " << view_id;
    return {};
  }

  std::string scene_;
};

TEST_F(ReplayTest, ASessionCountsInvalidSamplesAndItsTokenReplaysTheFirst) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  const std::string session = create_session(scene_, 40, 30, 64);
  StreamClient client(stub(), session);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  client.send(view(2, 0.02));
  ASSERT_TRUE(client.reader().wait_for_frame_end(2));
  const auto messages = client.reader().messages();
  std::uint64_t total = 0;
  for (const std::uint64_t id : {1, 2}) {
    const pb::FrameEnd end = end_of(messages, id);
    const std::uint64_t invalid = end.totals().invalid_samples();
    EXPECT_GT(invalid, 0u);
    EXPECT_LT(invalid, 64u * 16) << "only the middle of the picture";
    EXPECT_EQ(invalid_in_tiles(messages, id), invalid);
    total += invalid;

    pb::ReplaySampleResponse told;
    const grpc::Status status = replay(end.replay_token(), &told);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(told.sample().sample().ShortDebugString(), end.first_invalid().ShortDebugString());
    EXPECT_EQ(told.sample().scene_id(), scene_);
    EXPECT_EQ(told.sample().main_file(), "overflow.gltf");
    EXPECT_FALSE(told.finite());
    EXPECT_EQ(told.first_not_finite_vertex(), 1u);
    EXPECT_EQ(told.first_not_finite(), "the light sample's contribution");
    EXPECT_EQ(told.note(), "");
    ASSERT_GE(told.vertices_size(), 1);
    const pb::TracedVertex& vertex = told.vertices(0);
    EXPECT_TRUE(vertex.hit());
    EXPECT_NEAR(vertex.origin().z(), 3, 1e-6);
    EXPECT_NEAR(vertex.position().z(), 0, 1e-4);
    EXPECT_TRUE(std::isinf(vertex.light().contribution().x()));
    EXPECT_TRUE(std::isfinite(vertex.light().radiance().x()));
    EXPECT_TRUE(vertex.light().delta());
    EXPECT_FALSE(vertex.light().occluded());
    EXPECT_EQ(vertex.emitted().x(), 2);
    EXPECT_EQ(vertex.lobe_model(), "metallic_roughness");
  }
  EXPECT_EQ(session_info(session).invalid_samples(), total);
}

// Each picture's samples have a seed of its own there, and their numbers do not count what was carried.
TEST_F(ReplayTest, ASampleOfAPictureThatDrawsOnAnotherIsReplayedToo) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  for (const pb::Mode mode : {pb::MODE_REPROJECT, pb::MODE_COMBINED}) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_);
    request.mutable_settings()->set_width(40);
    request.mutable_settings()->set_height(30);
    request.mutable_settings()->set_mode(mode);
    request.mutable_budget()->set_samples(64);
    pb::CreateSessionResponse created;
    ASSERT_TRUE(create(request, &created).ok());
    StreamClient client(stub(), created.session_id());
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    client.send(view(2, 0.02));
    ASSERT_TRUE(client.reader().wait_for_frame_end(2));
    const auto messages = client.reader().messages();
    std::map<std::uint64_t, std::uint64_t> seeds;
    for (const auto& message : messages) {
      if (message.has_frame_begin())
        seeds[message.frame_begin().tag().view_id()] = message.frame_begin().settings().seed();
    }
    EXPECT_NE(seeds[1], seeds[2]);
    const pb::FrameEnd end = end_of(messages, 2);
    EXPECT_GT(end.totals().reuse_share(), 0);
    EXPECT_GT(end.totals().invalid_samples(), 0u);
    EXPECT_EQ(invalid_in_tiles(messages, 2), end.totals().invalid_samples());
    pb::ReplaySampleResponse told;
    const grpc::Status status = replay(end.replay_token(), &told);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(told.sample().mode(), mode);
    EXPECT_EQ(told.sample().seed(), seeds[2]);
    EXPECT_EQ(told.sample().sample().ShortDebugString(), end.first_invalid().ShortDebugString());
    EXPECT_FALSE(told.finite());
  }
}

// Either kind of tile has samples of its own.
TEST_F(ReplayTest, ASampleWithALightPathIsReplayedInItsBits) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  for (const pb::Integrator integrator :
       {pb::INTEGRATOR_BDPT, pb::INTEGRATOR_PT_BDPT, pb::INTEGRATOR_LVC, pb::INTEGRATOR_VCM, pb::INTEGRATOR_PHOTON}) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_);
    request.mutable_settings()->set_width(40);
    request.mutable_settings()->set_height(30);
    request.mutable_settings()->set_integrator(integrator);
    request.mutable_budget()->set_samples(64);
    pb::CreateSessionResponse created;
    ASSERT_TRUE(create(request, &created).ok());
    StreamClient client(stub(), created.session_id());
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    const pb::FrameEnd end = end_of(client.reader().messages(), 1);
    ASSERT_GT(end.totals().invalid_samples(), 0u);
    pb::ReplaySampleResponse told;
    const grpc::Status status = replay(end.replay_token(), &told);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(told.sample().sample().ShortDebugString(), end.first_invalid().ShortDebugString());
    EXPECT_NE(told.sample().integrator(), pb::INTEGRATOR_PT_BDPT);
    EXPECT_EQ(told.sample().light_paths() > 0, told.sample().integrator() != pb::INTEGRATOR_UNSPECIFIED);
    if (integrator != pb::INTEGRATOR_PT_BDPT) {
      EXPECT_EQ(told.sample().integrator(), integrator);
      EXPECT_EQ(told.sample().light_paths(), 40u * 30);
    }
    EXPECT_FALSE(told.finite());
    EXPECT_NE(told.first_not_finite(), "");
  }
}

// Tokens are not signed: one that asks for more light paths than its film ever had would take memory that nobody
// reserved.
TEST_F(ReplayTest, APassOfMoreLightPathsThanTheFilmHadIsRefused) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  LoadedScene scene;
  scene.id = scene_;
  FrameBegin begin;
  begin.camera = *look_at({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 0.7);
  begin.settings.width = 40;
  begin.settings.height = 30;
  for (const Integrator integrator : {Integrator::lvc, Integrator::vcm, Integrator::photon}) {
    begin.settings.integrator = integrator;
    InvalidSample sample{20, 15, 0, 3};
    pb::ReplaySampleResponse told;
    sample.light_paths = 40 * 30;
    EXPECT_TRUE(replay(make_replay_token(scene, begin, sample), &told).ok()) << to_string(integrator);
    for (const std::uint64_t paths : {std::uint64_t(2 * 40 * 30 + 1), std::uint64_t(1) << 18}) {
      sample.light_paths = paths;
      const grpc::Status status = replay(make_replay_token(scene, begin, sample), &told);
      EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
      EXPECT_NE(status.error_message().find("token.light_paths: " + std::to_string(paths)), std::string::npos)
          << status.error_message();
    }
  }
}

TEST_F(ReplayTest, AJobCountsTheInvalidSamplesOfAllItsViews) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  pb::RunJobRequest request;
  request.set_scene_id(scene_);
  request.mutable_settings()->set_width(40);
  request.mutable_settings()->set_height(30);
  request.mutable_budget()->set_samples(64);
  for (const double x : {0.0, 0.02, 0.9}) {
    *request.add_views() = view(1, x).camera();
  }
  request.mutable_views(2)->mutable_look_at()->mutable_target()->set_y(30);  // sees nothing of it
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
  auto reader = stub().RunJob(&context, request);
  std::vector<pb::FrameEnd> ends;
  std::uint64_t counted = 0;
  pb::RunJobResponse response;
  while (reader->Read(&response)) {
    if (response.has_view_result()) ends.push_back(response.view_result().end());
    if (!response.has_result()) continue;
    ends.push_back(response.result().end());
    counted = response.result().invalid_samples();
  }
  const grpc::Status status = reader->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(ends.size(), 3u);
  std::uint64_t total = 0;
  for (const pb::FrameEnd& end : ends) {
    total += end.totals().invalid_samples();
    EXPECT_EQ(end.replay_token().empty(), end.totals().invalid_samples() == 0);
  }
  EXPECT_GT(ends[0].totals().invalid_samples(), 0u);
  EXPECT_EQ(ends[2].totals().invalid_samples(), 0u);
  EXPECT_EQ(counted, total);
}

TEST_F(ReplayTest, SaysWhatIsWrongWithATokenOrWhichSceneIsMissing) {
  ASSERT_NO_FATAL_FAILURE(start_with_overflow());
  pb::ReplaySampleResponse told;
  expect_status(replay("", &told), StatusCode::INVALID_ARGUMENT, {"token", "hg1-"});
  expect_status(replay("hg1-AAAAAAAA", &told), StatusCode::INVALID_ARGUMENT, {"token", "checksum"});
  const std::string session = create_session(scene_, 40, 30, 64);
  std::string token;
  {
    StreamClient client(stub(), session);
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    token = end_of(client.reader().messages(), 1).replay_token();
  }
  pb::CloseSessionRequest close;
  close.set_session_id(session);
  pb::CloseSessionResponse closed;
  ASSERT_TRUE(call(&pb::RenderService::Stub::CloseSession, close, &closed).ok());
  pb::UnloadSceneRequest unload;
  unload.set_scene_id(scene_);
  pb::UnloadSceneResponse unloaded;
  ASSERT_TRUE(eventually([&] { return call(&pb::RenderService::Stub::UnloadScene, unload, &unloaded).ok(); }));
  expect_status(replay(token, &told), StatusCode::NOT_FOUND,
                {"token", scene_.substr(0, 12), "overflow.gltf", "environment '0,0,0'"});
}

}  // namespace
}  // namespace helio::test
