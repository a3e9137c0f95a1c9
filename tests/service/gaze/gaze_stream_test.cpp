// Where a client looks, over a stream and by UpdateSession.
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "renderer/codec/tile_codec.h"
#include "../service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class GazeStreamTest : public ServiceTest {
 protected:
  std::string make_session(std::uint32_t samples, pb::Foveation foveation = pb::FOVEATION_DENSITY) {
    if (!server_) start();
    pb::CreateSessionRequest request;
    request.set_scene_id(load_quad());
    request.mutable_settings()->set_width(96);
    request.mutable_settings()->set_height(64);
    request.mutable_settings()->set_foveation(foveation);
    if (samples > 0) request.mutable_budget()->set_samples(samples);
    pb::CreateSessionResponse response;
    const grpc::Status status = create(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.settings().foveation(), foveation);
    EXPECT_EQ(response.settings().viewing_distance(), foveation == pb::FOVEATION_DENSITY ? 2 : 0);
    return response.session_id();
  }
};

pb::StreamRequest gaze_at(double x, double y) {
  pb::StreamRequest request;
  request.mutable_gaze()->mutable_gaze()->set_x(x);
  request.mutable_gaze()->mutable_gaze()->set_y(y);
  return request;
}

pb::View looking_at(std::uint64_t id, double x, double y) {
  pb::View looking = view(id);
  looking.mutable_gaze()->set_x(x);
  looking.mutable_gaze()->set_y(y);
  return looking;
}

bool wait_for_ends(StreamClient& client, int count) {
  return client.reader().wait_for([](const auto& message) { return message.has_frame_end(); }, count);
}

std::size_t ended(StreamClient& client) {
  std::size_t count = 0;
  for (const auto& message : client.reader().messages()) count += message.has_frame_end();
  return count;
}

// Of 8 x 8 pixels of the newest tiles.
double samples_at(StreamClient& client, int x, int y) {
  double sum = 0;
  std::map<std::pair<int, int>, std::string> tiles;
  for (const auto& message : client.reader().messages()) {
    if (message.has_tile()) tiles[{message.tile().window().x0(), message.tile().window().y0()}] = message.tile().exr();
  }
  for (const auto& [at, exr] : tiles) {
    const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size()}, 1 << 20);
    EXPECT_TRUE(tile.ok());
    const PixelRect w = tile->header.data_window;
    const std::vector<float>& samples = *tile->find("samples");
    for (int py = std::max(w.y0, y - 4); py < std::min(w.y1, y + 4); ++py) {
      for (int px = std::max(w.x0, x - 4); px < std::min(w.x1, x + 4); ++px)
        sum += samples[std::size_t(py - w.y0) * std::size_t(w.width()) + std::size_t(px - w.x0)];
    }
  }
  return sum / 64;
}

TEST_F(GazeStreamTest, AMoveTakesSamplesThereWithoutARevision) {
  const std::string id = make_session(64);
  StreamClient client(stub(), id);
  client.send(looking_at(1, 16, 32));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  EXPECT_GT(samples_at(client, 16, 32), 3 * samples_at(client, 88, 32));
  const std::uint64_t revision = session_info(id).revision();
  client.send(gaze_at(80, 32));
  ASSERT_TRUE(wait_for_ends(client, 2));
  EXPECT_GT(samples_at(client, 80, 32), 0.6 * samples_at(client, 16, 32));
  EXPECT_EQ(session_info(id).revision(), revision);
  for (const auto& message : client.reader().messages()) {
    if (message.has_frame_end()) {
      EXPECT_EQ(message.frame_end().reason(), pb::END_REASON_SAMPLES);
    }
  }
}

TEST_F(GazeStreamTest, BeforeAViewAndWithoutFoveationItSaysNothing) {
  const std::string id = make_session(8, pb::FOVEATION_NONE);
  StreamClient client(stub(), id);
  client.send(gaze_at(3, 4));
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  client.send(gaze_at(5, 4));
  client.send(view(2));
  ASSERT_TRUE(client.reader().wait_for_frame_end(2));
  EXPECT_EQ(ended(client), 2u);
}

TEST_F(GazeStreamTest, WhatIsNoPointIsRefusedByPlace) {
  for (const double bad : {std::nan(""), 1.5e6, -std::numeric_limits<double>::infinity()}) {
    const std::string first = make_session(8), second = make_session(8);
    StreamClient client(stub(), first);
    client.send(view(1));
    client.send(gaze_at(3, bad));
    expect_status(client.status(), StatusCode::INVALID_ARGUMENT, {"gaze.gaze.y", "[-1000000, 1000000]"});
    StreamClient other(stub(), second);
    other.send(looking_at(1, bad, 3));
    expect_status(other.status(), StatusCode::INVALID_ARGUMENT, {"view.gaze.x"});
  }
}

TEST_F(GazeStreamTest, UpdateSessionMovesItAlone) {
  const std::string id = make_session(64);
  StreamClient client(stub(), id);
  client.send(looking_at(1, 16, 32));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  pb::UpdateSessionRequest update;
  update.set_session_id(id);
  update.mutable_gaze()->mutable_gaze()->set_x(80);
  update.mutable_gaze()->mutable_gaze()->set_y(32);
  pb::UpdateSessionResponse response;
  const std::uint64_t revision = session_info(id).revision();
  ASSERT_TRUE(call(&pb::RenderService::Stub::UpdateSession, update, &response).ok());
  EXPECT_EQ(response.revision(), revision);
  ASSERT_TRUE(wait_for_ends(client, 2));
  update.mutable_budget()->set_samples(3);
  expect_status(call(&pb::RenderService::Stub::UpdateSession, update, &response), StatusCode::INVALID_ARGUMENT,
                {"gaze", "allowed: alone"});
}

TEST_F(GazeStreamTest, JobsHaveNone) {
  start();
  pb::RunJobRequest job;
  job.set_scene_id(load_quad());
  job.mutable_settings()->set_foveation(pb::FOVEATION_DENSITY);
  job.mutable_budget()->set_samples(1);
  grpc::ClientContext context;
  expect_status(stub().RunJob(&context, job)->Finish(), StatusCode::INVALID_ARGUMENT,
                {"settings.foveation", "allowed: none"});
}

}  // namespace
}  // namespace helio::test
