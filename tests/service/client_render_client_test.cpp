// The library against a daemon in the same process.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "client/frame_assembler.h"
#include "client/grpc_error.h"
#include "client/render_client.h"
#include "process.h"
#include "renderer/base/clock.h"
#include "service_fixture.h"
#include "tcp_relay.h"

namespace helio::test {
namespace {

class RenderClientTest : public testing::Test {
 protected:
  void SetUp() override {
    ServerConfig config;
    config.render_threads = 2;
    auto server = Server::start(config);
    ASSERT_TRUE(server) << server.error().to_string();
    server_ = std::move(server).value();
    write_file(folder_ / "quad.gltf", quad_gltf(2));
    auto client = RenderClient::connect(server_->address());
    ASSERT_TRUE(client) << client.error().to_string();
    client_ = std::move(client).value();
  }

  pb::SceneInfo load() {
    const auto local = collect_local_scene(folder_ / "quad.gltf", "0,0,0");
    const auto response = client_->upload_scene(*local);
    EXPECT_TRUE(response) << response.error().to_string();
    return response ? response->scene() : pb::SceneInfo();
  }

  pb::RunJobRequest job(std::uint32_t samples) {
    pb::RunJobRequest request;
    request.set_scene_id(load().scene_id());
    request.mutable_settings()->set_width(40);
    request.mutable_settings()->set_height(30);
    request.mutable_budget()->set_samples(samples);
    request.set_preview_tiles(true);
    return request;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<RenderClient> client_;
};

// The square of radiance 2 covers the middle of the picture: 2 units wide, seen from 3 units at 0.8 radians of height
// 2 * 3 tan(0.4) = 2.54 units.
void expect_square(const Picture& picture) {
  const std::vector<float>* red = picture.find("R");
  ASSERT_TRUE(red);
  EXPECT_EQ((*red)[15 * 40 + 20], 2);
  EXPECT_EQ((*red)[0], 0);
}

TEST(GrpcError, AFullQuotaIsSaidInWords) {
  const auto code = grpc::StatusCode::RESOURCE_EXHAUSTED;
  const Error error = to_error({code, "Received RST_STREAM with error code 11"}, "here:1");
  EXPECT_EQ(error.code, ErrorCode::resource_exhausted);
  EXPECT_NE(error.message.find("the server at here:1 has no memory left"), std::string::npos) << error.message;
  EXPECT_EQ(to_error({code, "max_sessions: all 2"}, "here:1").message, "max_sessions: all 2");
}

TEST_F(RenderClientTest, TellsAboutTheServer) {
  const auto info = client_->server_info();
  ASSERT_TRUE(info) << info.error().to_string();
  EXPECT_EQ(info->threads(), 2);
  EXPECT_GT(info->limits().max_film_side(), 0);
}

TEST_F(RenderClientTest, UploadsOnceAndFindsAgain) {
  std::uint64_t sent = 0, total = 0;
  SceneLoadRequest request;
  request.uploaded = [&](std::uint64_t s, std::uint64_t t) {
    sent = s;
    total = t;
  };
  const auto local = collect_local_scene(folder_ / "quad.gltf", "0,0,0");
  const auto first = client_->upload_scene(*local, request);
  ASSERT_TRUE(first) << first.error().to_string();
  EXPECT_EQ(sent, local->total_bytes());
  EXPECT_EQ(total, local->total_bytes());
  EXPECT_EQ(first->scene().triangles(), 2u);
  const auto again = client_->upload_scene(*local);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->already_loaded());
  EXPECT_EQ(client_->list_scenes()->scenes_size(), 1);
  ASSERT_TRUE(client_->unload_scene(first->scene().scene_id()));
  EXPECT_EQ(client_->unload_scene(first->scene().scene_id()).error().code, ErrorCode::not_found);
}

TEST_F(RenderClientTest, PassesOnWhyASceneIsRefused) {
  write_file(folder_ / "broken.gltf",
             R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "none.bin", "byteLength": 4}],
    "bufferViews": [{"buffer": 0, "byteLength": 4}], "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1,
    "type": "SCALAR"}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}],
    "scenes": [{"nodes": [0]}], "scene": 0})");
  const auto response = client_->upload_scene(*collect_local_scene(folder_ / "broken.gltf", ""));
  ASSERT_FALSE(response);
  EXPECT_NE(response.error().to_string().find("broken.gltf"), std::string::npos) << response.error().to_string();
}

TEST_F(RenderClientTest, AFileThatChangesIsNotUploaded) {
  const auto local = collect_local_scene(folder_ / "quad.gltf", "");
  write_file(folder_ / "quad.gltf", quad_gltf(2) + "   ");
  const auto response = client_->upload_scene(*local);
  ASSERT_FALSE(response);
  EXPECT_NE(response.error().to_string().find("changed"), std::string::npos) << response.error().to_string();
  EXPECT_EQ(client_->list_scenes()->scenes_size(), 0);
}

TEST_F(RenderClientTest, RunsAJob) {
  FrameAssembler picture;
  int progress = 0;
  JobCallbacks callbacks;
  callbacks.accepted = [&](const auto& accepted) { EXPECT_TRUE(picture.begin(accepted.settings())); };
  callbacks.tile = [&](pb::Tile tile) { EXPECT_TRUE(picture.add(std::move(tile))); };
  callbacks.progress = [&](const auto&) { ++progress; };
  const auto end = client_->run_job(job(8), callbacks);
  ASSERT_TRUE(end) << end.error().to_string();
  EXPECT_EQ(end->reason(), pb::END_REASON_SAMPLES);
  EXPECT_TRUE(picture.final());
  EXPECT_EQ(picture.samples_per_pixel(), 8u);
  expect_square(**picture.picture());
}

TEST_F(RenderClientTest, RunsAPathViewByView) {
  pb::RunJobRequest path = job(4);
  for (int i = 0; i < 3; ++i) path.add_views()->set_scene_camera("front");
  FrameAssembler picture;
  pb::RenderSettings settings;
  std::vector<std::uint32_t> views;
  JobCallbacks callbacks;
  callbacks.accepted = [&](const auto& accepted) {
    settings = accepted.settings();
    EXPECT_TRUE(picture.begin(settings));
  };
  callbacks.tile = [&](pb::Tile tile) { EXPECT_TRUE(picture.add(std::move(tile))); };
  callbacks.view_result = [&](const auto& result) {
    views.push_back(result.view());
    EXPECT_TRUE(picture.final());
    expect_square(**picture.picture());
    EXPECT_TRUE(picture.begin(settings));
  };
  const auto end = client_->run_job(path, callbacks);
  ASSERT_TRUE(end) << end.error().to_string();
  EXPECT_EQ(views, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(end->reason(), pb::END_REASON_SAMPLES);
  EXPECT_TRUE(picture.final());
  expect_square(**picture.picture());
}

TEST_F(RenderClientTest, ACancelledJobTellsWhatItDid) {
  JobCallbacks callbacks;
  FrameAssembler picture;
  std::thread canceller;
  callbacks.accepted = [&](const auto& accepted) {
    EXPECT_TRUE(picture.begin(accepted.settings()));
    canceller = std::thread([client = client_.get(), id = accepted.job_id()] {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      EXPECT_TRUE(client->cancel_job(id));
    });
  };
  callbacks.tile = [&](pb::Tile tile) { EXPECT_TRUE(picture.add(std::move(tile))); };
  const auto end = client_->run_job(job(1u << 30), callbacks);
  ASSERT_TRUE(canceller.joinable());
  canceller.join();
  ASSERT_TRUE(end) << end.error().to_string();
  EXPECT_EQ(end->reason(), pb::END_REASON_CANCELLED);
  EXPECT_TRUE(picture.complete());
  expect_square(**picture.picture());
}

TEST_F(RenderClientTest, AControlEndsTheCall) {
  CallControl control;
  JobCallbacks callbacks;
  callbacks.accepted = [&](const auto&) { control.cancel(); };
  const auto end = client_->run_job(job(1u << 30), callbacks, &control);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::cancelled);
  // Once cancelled it stays so: whoever asked to stop does not get the next call either.
  const auto next = client_->run_job(job(1), {}, &control);
  ASSERT_FALSE(next);
  EXPECT_EQ(next.error().code, ErrorCode::cancelled);
}

TEST_F(RenderClientTest, StreamsTheNewestView) {
  pb::CreateSessionRequest request;
  request.set_scene_id(load().scene_id());
  request.mutable_settings()->set_width(40);
  request.mutable_settings()->set_height(30);
  request.mutable_budget()->set_samples(4);
  const auto session = client_->create_session(request);
  ASSERT_TRUE(session) << session.error().to_string();

  std::mutex mutex;
  std::condition_variable changed;
  FrameAssembler picture;
  std::uint64_t done = 0;
  FrameCallbacks callbacks;
  callbacks.frame_begin = [&](const pb::FrameBegin& frame) {
    std::lock_guard lock(mutex);
    EXPECT_TRUE(picture.begin(frame));
  };
  callbacks.tile = [&](pb::Tile tile) {
    std::lock_guard lock(mutex);
    EXPECT_TRUE(picture.add(std::move(tile)));
  };
  callbacks.frame_end = [&](const pb::FrameEnd& end) {
    std::lock_guard lock(mutex);
    if (end.reason() == pb::END_REASON_SAMPLES) done = end.tag().view_id();
    changed.notify_all();
  };
  pb::StreamRequest::Open open;
  open.set_session_id(session->session_id());
  const auto stream = client_->stream_frames(open, callbacks);
  for (std::uint64_t id = 1; id <= 3; ++id) ASSERT_TRUE(stream->send_view(view(id)));
  {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(60), [&] { return done == 3; }));
    EXPECT_TRUE(picture.complete());
    expect_square(**picture.picture());
  }
  ASSERT_TRUE(stream->close(true));
  EXPECT_TRUE(stream->wait());
  EXPECT_FALSE(stream->send_view(view(4)));
  EXPECT_EQ(client_->list_sessions()->sessions_size(), 0);
}

TEST_F(RenderClientTest, ABadViewEndsTheStreamAndNamesTheField) {
  pb::CreateSessionRequest request;
  request.set_scene_id(load().scene_id());
  const auto session = client_->create_session(request);
  ASSERT_TRUE(session);
  pb::StreamRequest::Open open;
  open.set_session_id(session->session_id());
  const auto stream = client_->stream_frames(open, {});
  pb::View bad = view(1);
  bad.mutable_camera()->set_vertical_fov(4);
  ASSERT_TRUE(stream->send_view(bad));
  const Status end = stream->wait();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(end.error().message.find("vertical_fov"), std::string::npos) << end.error().message;
  EXPECT_EQ(client_->list_sessions()->sessions_size(), 1);
}

TEST_F(RenderClientTest, AStreamThatIsDroppedLeavesTheSession) {
  pb::CreateSessionRequest request;
  request.set_scene_id(load().scene_id());
  const auto session = client_->create_session(request);
  pb::StreamRequest::Open open;
  open.set_session_id(session->session_id());
  client_->stream_frames(open, {}).reset();
  EXPECT_TRUE(client_->close_session(session->session_id()));
}

TEST_F(RenderClientTest, UpdatesAndWatches) {
  pb::CreateSessionRequest request;
  request.set_scene_id(load().scene_id());
  request.mutable_settings()->set_width(40);
  request.mutable_settings()->set_height(30);
  request.mutable_budget()->set_samples(4);
  const auto session = client_->create_session(request);
  ASSERT_TRUE(session);
  pb::UpdateSessionRequest update;
  update.set_session_id(session->session_id());
  *update.mutable_view() = view(1);
  const auto revision = client_->update_session(update);
  ASSERT_TRUE(revision) << revision.error().to_string();
  EXPECT_GT(*revision, 0u);

  CallControl control;
  FrameCallbacks callbacks;
  std::atomic<int> tiles{0};
  callbacks.tile = [&](const pb::Tile&) {
    ++tiles;
    control.cancel();
  };
  pb::WatchFramesRequest watch;
  watch.set_session_id(session->session_id());
  const Status watched = client_->watch_frames(watch, callbacks, &control);
  ASSERT_FALSE(watched);
  EXPECT_EQ(watched.error().code, ErrorCode::cancelled);
  EXPECT_GT(tiles, 0);
}

TEST_F(RenderClientTest, WorksInProcess) {
  RenderClient inside(server_->in_process_channel(), "in process");
  const auto response = inside.upload_scene(*collect_local_scene(folder_ / "quad.gltf", ""));
  ASSERT_TRUE(response) << response.error().to_string();
  EXPECT_EQ(inside.list_scenes()->scenes_size(), 1);
}

TEST_F(RenderClientTest, AServerThatStopsIsUnavailable) {
  server_.reset();
  const auto info = client_->server_info();
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().code, ErrorCode::unavailable);
}

TEST(RenderClientConnect, RefusedAtOnceOrAfterTheWait) {
  // Port 1 (tcpmux) is served nowhere.
  ConnectOptions once;
  once.timeout_s = 3600;
  const auto refused = RenderClient::connect("127.0.0.1:1", once);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
  EXPECT_NE(refused.error().message.find("127.0.0.1:1"), std::string::npos);

  ConnectOptions patient;
  patient.timeout_s = 0.5;
  patient.retry = true;
  const double again = now_s();
  EXPECT_FALSE(RenderClient::connect("127.0.0.1:1", patient));
  EXPECT_GE(now_s() - again, 0.45);
  EXPECT_EQ(RenderClient::connect("nowhere").error().code, ErrorCode::invalid_argument);
}

TEST_F(RenderClientTest, ASlowLinkConnects) {
  const TcpRelay link(server_->address(), 1.5);
  const auto client = RenderClient::connect(link.address());
  ASSERT_TRUE(client) << client.error().to_string();
  EXPECT_TRUE((*client)->server_info());
}

}  // namespace
}  // namespace helio::test
