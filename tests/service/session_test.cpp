// Sessions without a stream, watches, limits, and what the daemon tells about itself.
#include <set>

#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class SessionTest : public ServiceTest {
 protected:
  grpc::Status update(const pb::UpdateSessionRequest& request, std::uint64_t* revision = nullptr) {
    pb::UpdateSessionResponse response;
    const grpc::Status status = call(&pb::RenderService::Stub::UpdateSession, request, &response);
    if (revision) *revision = response.revision();
    return status;
  }
  grpc::Status close(const std::string& session) {
    pb::CloseSessionRequest request;
    pb::CloseSessionResponse response;
    request.set_session_id(session);
    return call(&pb::RenderService::Stub::CloseSession, request, &response);
  }
};

TEST_F(SessionTest, ServerInfoStatesItsLimits) {
  start([](ServerConfig& config) {
    config.max_sessions = 3;
    config.max_film_pixels = 1000;
  });
  pb::GetServerInfoResponse info;
  ASSERT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  EXPECT_FALSE(info.version().empty());
  EXPECT_EQ(info.threads(), 2);
  EXPECT_EQ(info.limits().max_sessions(), 3);
  EXPECT_EQ(info.limits().max_film_pixels(), 1000u);
  EXPECT_EQ(info.limits().max_message_bytes(), 4u << 20);
  EXPECT_EQ(info.limits().max_scene_memory(), info.limits().max_memory());
  ASSERT_EQ(info.devices_size(), 1);
  EXPECT_NE(info.devices(0).name().find("Embree"), std::string::npos);
  EXPECT_NE(info.no_vulkan_reason().find("--devices cpu,vulkan"), std::string::npos) << info.no_vulkan_reason();
  EXPECT_EQ(std::vector<int>(info.modes().begin(), info.modes().end()),
            (std::vector<int>{pb::MODE_PT, pb::MODE_ADAPTIVE, pb::MODE_REPROJECT, pb::MODE_COMBINED}));
  EXPECT_EQ(std::vector<int>(info.integrators().begin(), info.integrators().end()),
            (std::vector<int>{pb::INTEGRATOR_PATH, pb::INTEGRATOR_LIGHT, pb::INTEGRATOR_BDPT, pb::INTEGRATOR_PT_BDPT,
                              pb::INTEGRATOR_LVC, pb::INTEGRATOR_VCM, pb::INTEGRATOR_PHOTON}));
  EXPECT_FALSE(info.draining());
}

TEST_F(SessionTest, DefaultsAreFilledIn) {
  start();
  pb::CreateSessionRequest request;
  request.set_scene_id(load_quad());
  pb::CreateSessionResponse response;
  ASSERT_TRUE(create(request, &response).ok());
  EXPECT_EQ(response.settings().width(), 1280);
  EXPECT_EQ(response.settings().height(), 720);
  EXPECT_EQ(response.settings().mode(), pb::MODE_PT);
  EXPECT_EQ(response.settings().integrator(), pb::INTEGRATOR_PATH);
  EXPECT_EQ(response.settings().max_segments(), 10);
  EXPECT_EQ(response.settings().roulette_from(), 3);
  EXPECT_EQ(response.settings().roulette(), pb::ROULETTE_RULE_ROOT);
  EXPECT_EQ(response.grace_s(), 60);
}

TEST_F(SessionTest, FiltersHaveTheirDefaultScales) {
  start();
  pb::CreateSessionRequest request;
  request.set_scene_id(load_quad());
  for (const auto& [filter, asked, scale] : {std::tuple(pb::PIXEL_FILTER_UNSPECIFIED, 0.0, 0.0),
                                             {pb::PIXEL_FILTER_BOX, 0.0, 0.0},
                                             {pb::PIXEL_FILTER_TENT, 0.0, 1.0},
                                             {pb::PIXEL_FILTER_GAUSSIAN, 0.0, 0.5},
                                             {pb::PIXEL_FILTER_TENT, 2.5, 2.5}}) {
    request.mutable_settings()->set_filter(filter);
    request.mutable_settings()->set_filter_scale(asked);
    pb::CreateSessionResponse response;
    ASSERT_TRUE(create(request, &response).ok());
    EXPECT_EQ(response.settings().filter(), filter == pb::PIXEL_FILTER_UNSPECIFIED ? pb::PIXEL_FILTER_BOX : filter);
    EXPECT_EQ(response.settings().filter_scale(), scale);
  }
}

TEST_F(SessionTest, CreateNamesEveryWrongField) {
  start();
  pb::CreateSessionRequest request;
  request.mutable_settings()->set_width(-5);
  request.mutable_settings()->set_max_segments(100000);
  request.mutable_budget()->set_error(-1);
  request.set_grace_s(-3);
  pb::CreateSessionResponse response;
  expect_status(create(request, &response), StatusCode::INVALID_ARGUMENT,
                {"scene_id: 0 bytes", "settings.width", "-5", "settings.max_segments", "100000", "budget.error",
                 "grace_s: -3; allowed: (0, 86400]"});
  request.Clear();
  request.set_scene_id("unknown");
  expect_status(create(request, &response), StatusCode::NOT_FOUND, {"scene_id", "'unknown'"});
}

TEST_F(SessionTest, UnknownIdsAreNotFound) {
  start();
  pb::UpdateSessionRequest request;
  request.set_session_id("s-none");
  expect_status(update(request), StatusCode::NOT_FOUND, {"session_id", "s-none"});
  expect_status(close("s-none"), StatusCode::NOT_FOUND, {"session_id", "s-none"});
  expect_status(close(""), StatusCode::INVALID_ARGUMENT, {"session_id: 0 bytes"});
  request.clear_session_id();
  expect_status(update(request), StatusCode::INVALID_ARGUMENT, {"session_id: 0 bytes"});
  pb::CancelJobRequest cancel;
  pb::CancelJobResponse cancelled;
  cancel.set_job_id("j-none");
  expect_status(call(&pb::RenderService::Stub::CancelJob, cancel, &cancelled), StatusCode::NOT_FOUND, {"j-none"});
  grpc::ClientContext context;
  pb::WatchFramesRequest watch;
  watch.set_session_id("s-none");
  watch.mutable_format()->set_compression(pb::Compression(50));
  pb::StreamResponse ignored;
  auto reader = stub().WatchFrames(&context, watch);
  EXPECT_FALSE(reader->Read(&ignored));
  expect_status(reader->Finish(), StatusCode::INVALID_ARGUMENT, {"format.compression: unknown value 50"});
}

TEST_F(SessionTest, SessionsAreLimited) {
  start([](ServerConfig& config) { config.max_sessions = 2; });
  const std::string scene = load_quad();
  const std::string first = create_session(scene, 8, 8), second = create_session(scene, 8, 8);
  StreamClient one(stub(), first), other(stub(), second);
  const auto opened = [](const auto& m) { return m.has_opened(); };
  ASSERT_TRUE(one.reader().wait_for(opened) && other.reader().wait_for(opened));
  pb::CreateSessionRequest request;
  request.set_scene_id(scene);
  pb::CreateSessionResponse response;
  const grpc::Status refused = create(request, &response);
  expect_status(refused, StatusCode::RESOURCE_EXHAUSTED, {"max_sessions", "2", "try again in 2 s"});
  // google.rpc.RetryInfo, as any client library finds it: field 1 is a Duration whose field 1 is 2.
  const std::string details = refused.error_details();
  EXPECT_NE(details.find("type.googleapis.com/google.rpc.RetryInfo\x12\x04\x0a\x02\x08\x02"), std::string::npos);
  ASSERT_TRUE(close(first).ok());
  EXPECT_TRUE(create(request, &response).ok()) << "a place is free again";
}

TEST_F(SessionTest, AFullDaemonEndsASessionWithoutAStreamBeforeItRefuses) {
  start([](ServerConfig& config) { config.max_sessions = 2; });
  const std::string scene = load_quad();
  const std::string first = create_session(scene, 8, 8), second = create_session(scene, 8, 8);
  StreamClient listener(stub(), first);
  ASSERT_TRUE(listener.reader().wait_for([](const auto& m) { return m.has_opened(); }));
  const std::string third = create_session(scene, 8, 8);
  EXPECT_FALSE(session_info(first).session_id().empty());
  EXPECT_TRUE(session_info(second).session_id().empty());
  StreamClient late(stub(), second);
  expect_status(late.status(), StatusCode::NOT_FOUND, {second});
  EXPECT_FALSE(session_info(third).session_id().empty());
}

TEST_F(SessionTest, ScenesAreLimited) {
  start([](ServerConfig& config) { config.max_scenes = 1; });
  load_quad(1);
  Upload other;
  other.bytes = quad_gltf(2);
  pb::LoadSceneResponse response;
  expect_status(load(other.messages(), &response), StatusCode::RESOURCE_EXHAUSTED, {"max_scenes", "1"});
}

TEST_F(SessionTest, MemoryIsLimitedAndGivenBack) {
  start([](ServerConfig& config) { config.max_memory = 64 << 20; });
  const std::string scene = load_quad();
  pb::CreateSessionRequest request;
  request.set_scene_id(scene);
  request.mutable_settings()->set_width(4096);
  request.mutable_settings()->set_height(4096);
  pb::CreateSessionResponse response;
  expect_status(create(request, &response), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "4096 x 4096"});
  // 540 x 540 pixels take 38 MB: one fits, a second does not, until the first has gone.
  const std::string first = create_session(scene, 540, 540);
  StreamClient listener(stub(), first);
  ASSERT_TRUE(listener.reader().wait_for([](const auto& m) { return m.has_opened(); }));
  request.mutable_settings()->set_width(540);
  request.mutable_settings()->set_height(540);
  expect_status(create(request, &response), StatusCode::RESOURCE_EXHAUSTED, {"max_memory"});
  pb::UpdateSessionRequest grow;
  grow.set_session_id(first);
  grow.mutable_settings()->set_width(2000);
  grow.mutable_settings()->set_height(2000);
  expect_status(update(grow), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "2000 x 2000"});
  EXPECT_EQ(session_info(first).settings().width(), 540) << "nothing has changed";
  ASSERT_TRUE(close(first).ok());
  EXPECT_TRUE(eventually([&] { return create(request, &response).ok(); }));
}

TEST_F(SessionTest, PreviewsCountAsMemory) {
  start([](ServerConfig& config) { config.max_memory = 64 << 20; });
  const std::string scene = load_quad();
  // 620 x 620 pixels take 51 MB, previews of them 23 MB more.
  pb::CreateSessionRequest request;
  request.set_scene_id(scene);
  request.mutable_settings()->set_width(620);
  request.mutable_settings()->set_height(620);
  request.mutable_settings()->set_preview_rate(20);
  pb::CreateSessionResponse response;
  expect_status(create(request, &response), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "previews of 620 x 620"});
  request.mutable_settings()->set_preview_rate(0);
  ASSERT_TRUE(eventually([&] { return create(request, &response).ok(); }));
  pb::UpdateSessionRequest ask;
  ask.set_session_id(response.session_id());
  *ask.mutable_settings() = request.settings();
  ask.mutable_settings()->set_preview_rate(20);
  expect_status(update(ask), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "previews of 620 x 620"});
  EXPECT_EQ(session_info(response.session_id()).settings().preview_rate(), 0) << "nothing has changed";
}

TEST_F(SessionTest, UploadedBytesCountAsMemory) {
  start([](ServerConfig& config) { config.max_memory = 1 << 20; });
  Upload upload;
  pb::LoadSceneRequest begin = upload.begin();
  begin.mutable_begin()->set_total_bytes(2 << 20);
  pb::LoadSceneResponse response;
  expect_status(load({begin}, &response), StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "2097152"});
}

TEST_F(SessionTest, UpdateRendersAndAWatchShowsIt) {
  start();
  const std::string session = create_session(load_quad(), 64, 64, 5);
  pb::UpdateSessionRequest request;
  request.set_session_id(session);
  *request.mutable_view() = view(1);
  std::uint64_t revision = 0;
  ASSERT_TRUE(update(request, &revision).ok());
  EXPECT_EQ(revision, 1u);
  // A bounded budget is rendered though nobody listens.
  EXPECT_TRUE(eventually([&] { return session_info(session).progress().samples_per_pixel() == 5; }));
  grpc::ClientContext context;
  pb::WatchFramesRequest watch;
  watch.set_session_id(session);
  auto reader = stub().WatchFrames(&context, watch);
  pb::StreamResponse response;
  bool final_tile = false;
  while (reader->Read(&response) && !response.has_frame_end())
    final_tile |= response.has_tile() && response.tile().final();
  EXPECT_TRUE(final_tile);
  EXPECT_EQ(response.frame_end().reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(response.frame_end().tag().view_id(), 1u);

  // Another watch takes over.
  grpc::ClientContext second_context;
  auto second = stub().WatchFrames(&second_context, watch);
  while (reader->Read(&response)) {
  }
  expect_status(reader->Finish(), StatusCode::ABORTED, {session});
  // Closing the session ends its stream.
  ASSERT_TRUE(close(session).ok());
  while (second->Read(&response)) {
  }
  EXPECT_TRUE(second->Finish().ok());
}

TEST_F(SessionTest, UnboundedUpdateWaitsForAListener) {
  start();
  const std::string session = create_session(load_quad(), 64, 64);
  pb::UpdateSessionRequest request;
  request.set_session_id(session);
  *request.mutable_view() = view(1);
  ASSERT_TRUE(update(request).ok());
  EXPECT_TRUE(comes_to_rest(session));
  StreamClient client(stub(), session);
  EXPECT_TRUE(client.reader().wait_for_tiles(1));
}

TEST_F(SessionTest, ViewThroughASceneCamera) {
  start();
  const std::string session = create_session(load_quad(0.5), 16, 16, 1);
  StreamClient client(stub(), session);
  pb::View by_name, by_number;
  by_name.set_id(1);
  by_name.mutable_camera()->set_scene_camera("front");
  by_number.set_id(2);
  by_number.mutable_camera()->set_scene_camera("0");
  client.send(by_name);
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  client.send(by_number);
  ASSERT_TRUE(client.reader().wait_for_frame_end(2));
}

TEST_F(SessionTest, SessionsShareOneScene) {
  start();
  const std::string scene = load_quad();
  for (int i = 0; i < 8; ++i) create_session(scene, 16, 16);
  pb::ListScenesResponse list;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &list).ok());
  ASSERT_EQ(list.scenes_size(), 1);
  EXPECT_EQ(list.scenes(0).references(), 8u);
}

TEST_F(SessionTest, InProcessChannelServesTheSame) {
  start([](ServerConfig& config) { config.listen.clear(); });
  EXPECT_TRUE(server_->address().empty());
  stub_ = pb::RenderService::NewStub(server_->in_process_channel());
  const std::string session = create_session(load_quad(), 32, 32, 2);
  StreamClient client(stub(), session);
  client.send(view(1));
  EXPECT_TRUE(client.reader().wait_for_frame_end(1));
}

// grpc.health.v1 by hand: request { string service = 1 }, response { status = 1 }, SERVING = 1, NOT_SERVING = 2.
TEST_F(SessionTest, HealthAndReflectionAnswer) {
  start();
  const std::string check = "/grpc.health.v1.Health/Check";
  const RawAnswer overall = send_raw(new_channel(), check, {""});
  ASSERT_TRUE(overall.status.ok()) << overall.status.error_message();
  EXPECT_EQ(overall.messages.at(0), "\x08\x01");
  const std::string name = "heliograph.v1.RenderService";
  const RawAnswer ours = send_raw(new_channel(), check, {"\x0A" + std::string(1, char(name.size())) + name});
  ASSERT_TRUE(ours.status.ok()) << ours.status.error_message();
  EXPECT_EQ(ours.messages.at(0), "\x08\x01");
  // ServerReflectionRequest { list_services = 7 }.
  const RawAnswer services = send_raw(new_channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                      {std::string("\x3A\x01*", 3)});
  ASSERT_TRUE(services.status.ok()) << services.status.error_message();
  EXPECT_NE(services.messages.at(0).find(name), std::string::npos);
}

}  // namespace
}  // namespace helio::test
