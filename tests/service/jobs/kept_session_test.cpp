// Interactive sessions that outlive their daemon: clients attach again, and no sample is lost.
#include <signal.h>

#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "../cli_test.h"
#include "../daemon_process.h"
#include "client/session_stream.h"
#include "kept_jobs_fixture.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

constexpr std::uint32_t kEndless = 1u << 30;

pb::View front(std::uint64_t id, double x = 278) {
  pb::View view;
  view.set_id(id);
  pb::CameraView& camera = *view.mutable_camera();
  camera.mutable_position()->set_x(x);
  camera.mutable_position()->set_y(273);
  camera.mutable_position()->set_z(-800);
  camera.mutable_look_at()->mutable_target()->set_x(278);
  camera.mutable_look_at()->mutable_target()->set_y(273);
  return view;
}

// Of the last tile: films of these tests have one.
std::string last_tile(StreamClient& client) {
  std::string exr;
  for (const auto& message : client.reader().messages()) {
    if (message.has_tile()) exr = message.tile().exr();
  }
  return exr;
}

// The first message of each kind; nothing: none has come.
std::optional<pb::Opened> first_opened(StreamClient& client) {
  for (const auto& message : client.reader().messages()) {
    if (message.has_opened()) return message.opened();
  }
  return std::nullopt;
}
std::optional<pb::Tile> first_tile(StreamClient& client) {
  for (const auto& message : client.reader().messages()) {
    if (message.has_tile()) return message.tile();
  }
  return std::nullopt;
}
std::optional<pb::Notice> first_notice(StreamClient& client) {
  for (const auto& message : client.reader().messages()) {
    if (message.has_notice()) return message.notice();
  }
  return std::nullopt;
}
std::optional<pb::FrameEnd> first_end(StreamClient& client) {
  for (const auto& message : client.reader().messages()) {
    if (message.has_frame_end()) return message.frame_end();
  }
  return std::nullopt;
}

class KeptSessionTest : public KeptJobsTest {
 protected:
  std::string make_session(const std::string& scene, std::uint32_t samples,
                           const std::function<void(pb::CreateSessionRequest&)>& change = {}) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene);
    request.mutable_settings()->set_width(48);
    request.mutable_settings()->set_height(48);
    request.mutable_budget()->set_samples(samples);
    if (change) change(request);
    pb::CreateSessionResponse response;
    const grpc::Status status = create(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.session_id();
  }
  // Attaches once the daemon has taken the session up.
  std::unique_ptr<StreamClient> attach(const std::string& id) {
    for (;;) {
      auto client = std::make_unique<StreamClient>(stub(), id);
      if (client->reader().wait_for([](const auto& m) { return m.has_opened(); })) return client;
      const grpc::Status status = client->status();
      if (status.error_code() != StatusCode::UNAVAILABLE) {
        ADD_FAILURE() << status.error_message();
        return client;
      }
      EXPECT_NE(status.error_message().find("being taken up; try again in"), std::string::npos)
          << status.error_message();
    }
  }
  // How an attempt to attach ends that the daemon refuses for good.
  grpc::Status refused(const std::string& id) {
    for (;;) {
      StreamClient client(stub(), id);
      const grpc::Status status = client.status();
      if (status.error_code() != StatusCode::UNAVAILABLE) return status;
    }
  }
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / "state/sessions")) names.insert(entry.path().filename());
    return names;
  }
};

struct Case {
  const char* name;
  pb::Mode mode;
  pb::Integrator integrator;
  std::uint32_t samples;
};

class KeptPictureTest : public KeptSessionTest, public testing::WithParamInterface<Case> {};

TEST_P(KeptPictureTest, EndsInTheBitsOfAnUndisturbedOne) {
  const Case& which = GetParam();
  const auto change = [&](pb::CreateSessionRequest& request) {
    request.mutable_settings()->set_mode(which.mode);
    request.mutable_settings()->set_integrator(which.integrator);
  };
  start_daemon();
  const std::string scene = load_scene();
  std::string expected;
  {
    StreamClient whole(stub(), make_session(scene, which.samples, change));
    whole.send(front(1));
    ASSERT_TRUE(whole.reader().wait_for_frame_end(1));
    expected = last_tile(whole);
  }

  const std::string id = make_session(scene, which.samples, change);
  std::uint32_t shown = 0;
  {
    StreamClient before(stub(), id);
    before.send(front(1));
    ASSERT_TRUE(before.reader().wait_for_tiles(3));
    restart();
    expect_status(before.status(), StatusCode::UNAVAILABLE,
                  {"the daemon restarts", "attach to this session again", "with its samples; try again in 1 s"});
    EXPECT_NE(before.status().error_details().find("google.rpc.RetryInfo"), std::string::npos);
    for (const auto& message : before.reader().messages()) {
      EXPECT_FALSE(message.has_frame_end()) << "the picture goes on";
      if (message.has_tile()) shown = message.tile().samples_per_pixel();
    }
  }
  EXPECT_LT(shown, which.samples) << "the restart came after the end";

  const auto after = attach(id);
  ASSERT_TRUE(after->reader().wait_for_frame_end(1));
  const auto opened = first_opened(*after);
  EXPECT_TRUE(opened->resumed());
  EXPECT_EQ(opened->session_id(), id);
  EXPECT_EQ(opened->scene_id(), scene);
  EXPECT_EQ(opened->view_id(), 1u);
  EXPECT_EQ(opened->settings().mode(), which.mode);
  EXPECT_EQ(opened->budget().samples(), which.samples);
  const auto first = first_tile(*after);
  EXPECT_GE(first->samples_per_pixel(), shown);
  EXPECT_TRUE(same_picture(last_tile(*after), expected));
  EXPECT_TRUE(files().empty()) << "what was taken up is kept no longer";
}

INSTANTIATE_TEST_SUITE_P(All, KeptPictureTest,
                         testing::Values(Case{"pt", pb::MODE_PT, pb::INTEGRATOR_PATH, 2048},
                                         Case{"adaptive", pb::MODE_ADAPTIVE, pb::INTEGRATOR_PATH, 512},
                                         Case{"pt_bdpt", pb::MODE_PT, pb::INTEGRATOR_PT_BDPT, 1024},
                                         Case{"lvc", pb::MODE_PT, pb::INTEGRATOR_LVC, 300}),
                         [](const auto& info) { return std::string(info.param.name); });

// Neither a picture that has come to its end nor one that was paused is rendered again.
TEST_F(KeptSessionTest, APictureThatIsDoneIsShownAgain) {
  start_daemon();
  const std::string scene = load_scene();
  const std::string id = make_session(scene, 16);
  StreamClient before(stub(), id);
  before.send(front(7));
  ASSERT_TRUE(before.reader().wait_for_frame_end(7));
  restart();
  const auto after = attach(id);
  ASSERT_TRUE(after->reader().wait_for_frame_end(7));
  EXPECT_TRUE(same_picture(last_tile(*after), last_tile(before)));
  const auto end = first_end(*after);
  EXPECT_EQ(end->reason(), pb::END_REASON_SAMPLES);
  EXPECT_EQ(end->totals().samples_per_pixel(), 16u);
  // And the session is as it was: larger numbers alone, and another view begins anew.
  after->send(front(8, 300));
  ASSERT_TRUE(after->reader().wait_for_frame_end(8));
}

TEST_F(KeptSessionTest, TwoRestartsWithoutAListenerLoseNothing) {
  start_daemon();
  const std::string id = make_session(load_scene(), kEndless);
  {
    StreamClient before(stub(), id);
    before.send(front(1));
    ASSERT_TRUE(before.reader().wait_for_tiles(4));
  }
  ASSERT_TRUE(eventually([&] { return !session_info(id).attached(); }));
  const auto reached = session_info(id).progress().samples_per_pixel();
  EXPECT_GT(reached, 0u);
  restart();
  ASSERT_TRUE(eventually([&] { return !session_info(id).session_id().empty(); }));
  restart();
  const auto after = attach(id);
  ASSERT_TRUE(after->reader().wait_for_tiles(1));
  const auto first = first_tile(*after);
  EXPECT_GE(first->samples_per_pixel(), reached);
}

TEST_F(KeptSessionTest, ModesThatReusePicturesBeginAnewAndSaySo) {
  start_daemon();
  const std::string id = make_session(load_scene(), 64, [](pb::CreateSessionRequest& request) {
    request.mutable_settings()->set_mode(pb::MODE_COMBINED);
  });
  StreamClient before(stub(), id);
  before.send(front(3));
  ASSERT_TRUE(before.reader().wait_for_frame_end(3));
  restart();
  expect_status(before.status(), StatusCode::UNAVAILABLE, {"without its samples", "mode combined"});
  const auto after = attach(id);
  ASSERT_TRUE(after->reader().wait_for_frame_end(3));
  const auto opened = first_opened(*after);
  // Not resumed(): the daemon may have taken new samples before we came.
  EXPECT_EQ(opened->settings().mode(), pb::MODE_COMBINED);
  const auto notice = first_notice(*after);
  ASSERT_TRUE(notice);
  EXPECT_NE(notice->text().find("samples of this picture begin anew: mode combined"), std::string::npos)
      << notice->text();
}

// One that was closed, whose grace is over, or whose scene is not kept, is gone; the daemon's other sessions are not.
TEST_F(KeptSessionTest, KeepsNoMoreThanThereIs) {
  start_daemon();
  const std::string scene = load_scene();
  const std::string closed = make_session(scene, 4), kept = make_session(scene, 4);
  pb::CloseSessionRequest close;
  close.set_session_id(closed);
  pb::CloseSessionResponse response;
  ASSERT_TRUE(call(&pb::RenderService::Stub::CloseSession, close, &response).ok());
  restart();
  expect_status(refused(closed), StatusCode::NOT_FOUND, {closed});
  ASSERT_TRUE(eventually([&] { return !session_info(kept).session_id().empty(); }));
  const std::string brief =
      make_session(scene, 4, [](pb::CreateSessionRequest& request) { request.set_grace_s(0.2); });
  StreamClient listener(stub(), brief);
  ASSERT_TRUE(listener.reader().wait_for([](const auto& m) { return m.has_opened(); }));
  server_->drain(10);
  server_.reset();
  // A daemon that stops while it takes sessions up may leave an older file beside the newer one.
  std::set<std::string> ids;
  for (const std::string& file : files()) ids.insert(file.substr(0, file.find('.')));
  EXPECT_EQ(ids, (std::set<std::string>{brief, kept}));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  start_daemon();
  expect_status(refused(brief), StatusCode::NOT_FOUND, {brief});
  EXPECT_TRUE(attach(kept));
}

TEST_F(KeptSessionTest, AnUploadThatIsNotKeptIsToldWithoutAPromise) {
  start_daemon([](ServerConfig& config) { config.max_state_scene_bytes = 1; });
  StreamClient client(stub(), make_session(load_scene(), kEndless));
  client.send(front(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  restart();
  expect_status(client.status(), StatusCode::UNAVAILABLE, {"cannot keep this session", "max_state_scene_bytes"});
  EXPECT_EQ(client.status().error_details(), "");
  EXPECT_TRUE(files().empty());
}

TEST_F(KeptSessionTest, PicturesBeyondTheLimitAreLeftOut) {
  start_daemon([](ServerConfig& config) { config.max_state_session_bytes = 1000; });
  StreamClient client(stub(), make_session(load_scene(), kEndless));
  client.send(front(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  server_->drain(10);
  expect_status(client.status(), StatusCode::UNAVAILABLE, {"without its samples", "max_state_session_bytes"});
  server_.reset();
  for (const std::string& file : files()) EXPECT_LT(fs::file_size(folder_ / ("state/sessions/" + file)), 2000u);
}

// A byte that is wrong in the record loses the session, one in the picture its samples; the daemon starts all the same.
TEST_F(KeptSessionTest, DamagedFilesAreLeftOut) {
  start_daemon();
  const std::string scene = load_scene();
  const std::string ids[] = {make_session(scene, kEndless), make_session(scene, kEndless), make_session(scene, 4)};
  std::vector<std::unique_ptr<StreamClient>> clients;
  for (const std::string& id : {ids[0], ids[1]}) {
    clients.push_back(std::make_unique<StreamClient>(stub(), id));
    clients.back()->send(front(1));
    ASSERT_TRUE(clients.back()->reader().wait_for_tiles(2));
  }
  server_->drain(10);
  server_.reset();
  const auto spoil = [&](const std::string& id, std::ptrdiff_t from_end) {
    const std::string file = folder_ / ("state/sessions/" + id + ".a");
    std::string bytes = read_file(file);
    ASSERT_GT(bytes.size(), 100u);
    bytes[from_end > 0 ? bytes.size() - std::size_t(from_end) : 60] ^= 1;
    write_file(file, bytes);
  };
  spoil(ids[0], 0);
  spoil(ids[1], 1);
  write_file(folder_ / "state/sessions/s-none.a", "no such thing");
  start_daemon();
  expect_status(refused(ids[0]), StatusCode::NOT_FOUND, {ids[0]});
  const auto after = attach(ids[1]);
  ASSERT_TRUE(after->reader().wait_for_tiles(1));
  const auto notice = first_notice(*after);
  ASSERT_TRUE(notice);
  EXPECT_NE(notice->text().find("checksum is another"), std::string::npos) << notice->text();
  EXPECT_TRUE(attach(ids[2]));
  ASSERT_TRUE(eventually([&] { return files().empty(); }));
}

// Without a state folder nothing is kept, and nothing is promised.
TEST_F(KeptSessionTest, WithoutAStateFolderStreamsEndAsEver) {
  start();
  StreamClient client(stub(), make_session(load_scene(), kEndless));
  client.send(front(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  server_->drain(10);
  EXPECT_EQ(client.status().error_message(), "the daemon is draining");
  EXPECT_EQ(client.status().error_details(), "");
}

// ---- the client library and the command, with a daemon that is a process

class RestartedDaemonTest : public KeptJobsTest {
 protected:
  void spawn(const std::string& address = "127.0.0.1:0") {
    daemon_ = std::make_unique<DaemonProcess>(std::vector<std::string>{
        "--log-level", "error", "--render-threads", "2", "--listen", address, "--state", folder_ / "state"});
    ASSERT_FALSE(daemon_->address().empty());
  }
  void respawn() {
    const std::string address = daemon_->address();
    daemon_->signal(SIGTERM);
    ASSERT_EQ(daemon_->wait(), 0);
    spawn(address);
  }

  std::unique_ptr<DaemonProcess> daemon_;
};

TEST_F(RestartedDaemonTest, AStreamOfTheLibraryGoesOnAndSendsWhatCameBetween) {
  spawn();
  auto client = RenderClient::connect(daemon_->address());
  ASSERT_TRUE(client);
  write_file(folder_ / "quad.gltf", quad_gltf(2));
  const auto scene = (*client)->upload_scene(*collect_local_scene(folder_ / "quad.gltf", "0,0,0"));
  ASSERT_TRUE(scene);
  pb::CreateSessionRequest create;
  create.set_scene_id(scene->scene().scene_id());
  create.mutable_settings()->set_width(64);
  create.mutable_settings()->set_height(64);
  const auto session = (*client)->create_session(create);
  ASSERT_TRUE(session);

  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::uint64_t, std::uint32_t> samples;  // of the newest tile, by view
  std::vector<bool> opened;                        // resumed
  int ends = 0, lost = 0, back = 0;
  const auto wait = [&](const std::function<bool()>& condition) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(60 * kPatience), condition);
  };
  const auto note = [&](const auto& what) {
    const std::lock_guard lock(mutex);
    what();
    changed.notify_all();
  };
  FrameCallbacks callbacks;
  callbacks.opened = [&](const pb::Opened& o) { note([&] { opened.push_back(o.resumed()); }); };
  callbacks.tile = [&](const pb::Tile& tile) {
    note([&] { samples[tile.tag().view_id()] = tile.samples_per_pixel(); });
  };
  callbacks.ended = [&](const Status&) { note([&] { ++ends; }); };
  ReattachOptions options;
  options.lost = [&](const Status& why) {
    // A try may still meet the daemon that drains.
    const std::string text = why.error().to_string();
    EXPECT_TRUE(text.find("the daemon restarts") != std::string::npos || text.find("draining") != std::string::npos)
        << text;
    note([&] { ++lost; });
  };
  options.back = [&] { note([&] { ++back; }); };
  pb::StreamRequest::Open open;
  open.set_session_id(session->session_id());
  SessionStream stream(**client, open, callbacks, options);
  ASSERT_TRUE(stream.send_view(view(1)).ok());
  ASSERT_TRUE(wait([&] { return samples[1] >= 4; }));
  const std::uint32_t reached = samples[1];
  respawn();
  ASSERT_TRUE(wait([&] { return back == 1 && samples[1] > reached; }));
  EXPECT_EQ(lost, 1);
  ASSERT_EQ(opened.size(), 2u);
  EXPECT_TRUE(opened[1]);

  // A view that no daemon has got is sent to the next one.
  const std::string address = daemon_->address();
  daemon_->signal(SIGTERM);
  ASSERT_EQ(daemon_->wait(), 0);
  ASSERT_TRUE(wait([&] { return lost == 2; }));
  pb::Budget budget;
  budget.set_samples(8);
  EXPECT_TRUE(stream.send_budget(budget).ok());
  EXPECT_TRUE(stream.send_view(view(2, 0.1)).ok());
  spawn(address);
  ASSERT_TRUE(wait([&] { return samples[2] == 8; }));
  EXPECT_TRUE(stream.close(true).ok());
  EXPECT_TRUE(stream.wait().ok()) << stream.wait().error().to_string();
  EXPECT_EQ(ends, 1);
}

TEST_F(RestartedDaemonTest, ASessionThatIsGoneEndsTheStreamWithASentence) {
  spawn();
  auto client = RenderClient::connect(daemon_->address());
  ASSERT_TRUE(client);
  write_file(folder_ / "quad.gltf", quad_gltf(2));
  const auto scene = (*client)->upload_scene(*collect_local_scene(folder_ / "quad.gltf", "0,0,0"));
  ASSERT_TRUE(scene);
  pb::CreateSessionRequest create;
  create.set_scene_id(scene->scene().scene_id());
  const auto session = (*client)->create_session(create);
  ASSERT_TRUE(session);
  pb::StreamRequest::Open open;
  open.set_session_id(session->session_id());
  std::mutex mutex;
  std::condition_variable changed;
  bool is_open = false;
  FrameCallbacks callbacks;
  callbacks.opened = [&](const pb::Opened&) {
    const std::lock_guard lock(mutex);
    is_open = true;
    changed.notify_all();
  };
  SessionStream stream(**client, open, callbacks, {});
  std::unique_lock lock(mutex);
  ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(60 * kPatience), [&] { return is_open; }));
  lock.unlock();
  const std::string address = daemon_->address();
  daemon_->signal(SIGTERM);
  ASSERT_EQ(daemon_->wait(), 0);
  fs::remove_all(folder_ / "state/sessions");
  spawn(address);
  const Status end = stream.wait();
  ASSERT_FALSE(end.ok());
  EXPECT_EQ(end.error().code, ErrorCode::unavailable);
  EXPECT_NE(end.error().message.find("came back without the session"), std::string::npos) << end.error().message;
  EXPECT_FALSE(stream.send_view(view(1)).ok());
}

TEST_F(RestartedDaemonTest, MoveKeepsItsPicturesThroughARestart) {
  spawn();
  write_file(folder_ / "quad.gltf", quad_gltf(2));
  write_file(folder_ / "path.json", R"({"views": [{"samples": 2}, {"samples": 4000}]})");
  Process move(HELIOGRAPH_PROGRAM,
               {"move", "quad.gltf", "--environment", "0,0,0", "--mode", "pt", "--size", "64x64", "--path", "path.json",
                "--output", "v.#.exr", "--server", daemon_->address(), "--progress", "always"},
               folder_.path());
  ASSERT_TRUE(move.wait_for_errors("view 1: ")) << move.errors();
  respawn();
  const ProcessResult result = move.wait(120 * kPatience);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("the daemon restarts"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("reconnecting, for 60 s at most"), std::string::npos) << result.err;
  EXPECT_NE(result.out.find("connected again"), std::string::npos) << result.out;
  const auto picture = read_exr(folder_ / "v.1.exr", 1 << 20);
  ASSERT_TRUE(picture) << picture.error().to_string();
  EXPECT_EQ((*picture->find("samples"))[32 * 64 + 32], 4000);
}

TEST_F(RestartedDaemonTest, MoveDoesNotWaitWhereItIsToldSo) {
  spawn();
  write_file(folder_ / "quad.gltf", quad_gltf(2));
  write_file(folder_ / "path.json", R"({"views": [{"samples": 1000000000}]})");
  Process move(HELIOGRAPH_PROGRAM,
               {"move", "quad.gltf", "--mode", "pt", "--size", "64x64", "--path", "path.json", "--output", "v.#.exr",
                "--server", daemon_->address(), "--progress", "always", "--reconnect", "0"},
               folder_.path());
  ASSERT_TRUE(move.wait_for_errors("view 0: ")) << move.errors();
  daemon_->signal(SIGTERM);
  ASSERT_EQ(daemon_->wait(), 0);
  const ProcessResult result = move.wait(60 * kPatience);
  EXPECT_EQ(result.exit_code, 4) << result.err;
}

}  // namespace
}  // namespace helio::test
