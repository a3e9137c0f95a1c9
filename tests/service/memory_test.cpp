// Memory of sessions and scenes, without gRPC: counted as long as it is there, and freed where nobody waits for it.
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <limits>
#include <thread>

#include "renderer/film/display/display_layer.h"
#include "renderer/frame/stages/trace_lights.h"
#include "renderer/scene/load/scene_loader.h"
#include "server/base/reaper.h"
#include "server/sessions/idle_room.h"
#include "server/sessions/session_registry.h"
#include "server/stream/convert.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

SceneRequest quad_request() {
  const std::string gltf = quad_gltf();
  SceneBundle bundle;
  bundle.main_file = "quad.gltf";
  bundle.files.push_back({"quad.gltf", {gltf.begin(), gltf.end()}});
  Sha256 hash;
  hash.update(gltf);
  bundle.digests["quad.gltf"] = hash.finish();
  SceneRequest request;
  request.files = std::move(bundle);
  return request;
}

// Makes room as a daemon does, or as a test has it.
class TestRoom final : public RoomMaker {
 public:
  explicit TestRoom(RoomMaker& idle) : idle_(idle) {}
  bool make_room(std::uint64_t bytes) override { return instead ? instead() : idle_.make_room(bytes); }
  std::uint64_t could_free() const override { return idle_.could_free(); }
  std::function<bool()> instead;

 private:
  RoomMaker& idle_;
};

class MemoryTest : public testing::Test {
 protected:
  explicit MemoryTest(std::uint64_t limit = 1ull << 30)
      : memory_(limit, &room_), scenes_(*SceneRoots::open({}), {1 << 20, 1 << 30, 100, 1}, memory_) {}

  void SetUp() override {
    auto loaded = scenes_.load(quad_request(), CancelToken());
    ASSERT_TRUE(loaded.ok()) << loaded.error().to_string();
    scene_id_ = loaded->scene->id;
    of_scene_ = memory_.used();
  }

  RenderContext::Resources resources() { return {engine_, memory_, timers_, reaper_}; }
  SceneLease lease() { return scenes_.acquire(scene_id_, "scene_id").value(); }
  static RenderSettings settings(int side) {
    RenderSettings settings;
    settings.width = settings.height = side;
    return settings;
  }
  static Budget one_sample() {
    Budget budget;
    budget.samples = 1;
    return budget;
  }
  Result<std::shared_ptr<RenderContext>> rendering(const RenderSettings& settings) {
    return RenderContext::create(resources(), lease(), settings, one_sample(), RenderRank::interactive,
                                 FramePublisher::Tiles::all, TileFormat().channels);
  }
  Result<std::shared_ptr<Session>> session(SessionRegistry& sessions, int side = 16) {
    return sessions.create(resources(), lease(), settings(side), one_sample(), 60, kLimits);
  }

  static constexpr RenderLimits kLimits{1 << 20, 1ull << 40};
  IdleRoom idle_room_{memory_, reaper_, scenes_, sessions_};
  TestRoom room_{idle_room_};
  MemoryAccount memory_;
  RenderEngine engine_{1};
  SceneRegistry scenes_;
  Reaper reaper_;
  TimerQueue timers_;
  SessionRegistry sessions_{100, timers_};
  std::string scene_id_;
  std::uint64_t of_scene_ = 0;
  Reservation used_by_others_;
};

View quad_view() {
  View view;
  view.id = 1;
  view.camera = *look_at(V3d(0, 0, 3), V3d(0, 0, 0), V3d(0, 1, 0), 0.8);
  return view;
}

TEST_F(MemoryTest, TheFilmThatIsReplacedCountsUntilItIsFreed) {
  auto created = rendering(settings(64));
  ASSERT_TRUE(created.ok());
  const std::shared_ptr<RenderContext> rendering = std::exchange(*created, nullptr);
  const std::uint64_t small = film_bytes(settings(64)), large = film_bytes(settings(128));
  EXPECT_EQ(memory_.used(), of_scene_ + small);
  {
    RenderLoop::Update update;
    update.settings = settings(128);
    ASSERT_TRUE(rendering->prepare(settings(128), TileFormat().channels, update).ok());
    rendering->loop().update(update);
  }
  // Without a view no frame begins, and the loop holds both films.
  EXPECT_EQ(memory_.used(), of_scene_ + small + large);
  RenderLoop::Update look;
  look.view = quad_view();
  rendering->loop().update(look);
  EXPECT_TRUE(eventually([&] { return memory_.used() == of_scene_ + large; }));
}

TEST_F(MemoryTest, AResizeThatDoesNotFitChangesNothing) {
  auto created = rendering(settings(64));
  ASSERT_TRUE(created.ok());
  const std::uint64_t before = memory_.used();
  RenderLoop::Update update;
  const Status refused = (*created)->prepare(settings(8192), TileFormat().channels, update);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(update.film, nullptr);
  EXPECT_EQ(memory_.used(), before);
}

TEST_F(MemoryTest, LightVerticesCountWithoutANewFilm) {
  RenderSettings cached = settings(64);
  cached.integrator = Integrator::pt_bdpt;
  RenderSettings other = cached;
  for (const Integrator integrator : kEveryIntegrator) {
    other.integrator = integrator;
    if (caches_light_vertices(integrator) && film_bytes(other) == film_bytes(cached)) break;
  }
  ASSERT_GT(scratch_bytes(other), 0u);
  auto created = rendering(cached);
  ASSERT_TRUE(created.ok());
  EXPECT_EQ(memory_.used(), of_scene_ + film_bytes(cached));
  RenderLoop::Update update;
  update.settings = other;
  ASSERT_TRUE((*created)->prepare(other, TileFormat().channels, update).ok());
  EXPECT_EQ(update.film, nullptr);
  EXPECT_EQ(memory_.used(), of_scene_ + film_bytes(cached) + scratch_bytes(other));
}

TEST_F(MemoryTest, TheDisplayLayerCountsWhileTilesHaveIt) {
  auto created = rendering(settings(64));
  ASSERT_TRUE(created.ok());
  RenderContext& rendering = **created;
  const std::uint64_t before = memory_.used();
  RenderLoop::Update update;
  update.channels = TileFormat().channels | kResolveDisplay;
  update.view = quad_view();
  ASSERT_TRUE(rendering.prepare(settings(64), *update.channels, update).ok());
  EXPECT_EQ(memory_.used(), before + 64 * 64 * DisplayLayer::bytes_per_pixel());
  rendering.loop().update(std::exchange(update, {}));
  update.channels = TileFormat().channels;
  ASSERT_TRUE(rendering.prepare(settings(64), *update.channels, update).ok());
  rendering.loop().update(update);
  EXPECT_TRUE(eventually([&] { return memory_.used() == before; }));

  used_by_others_ = memory_.reserve(memory_.available(), "a test").value();
  RenderLoop::Update more;
  const Status refused = rendering.prepare(settings(64), TileFormat().channels | kResolveDisplay, more);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_NE(refused.error().message.find("the layer display of 64 x 64"), std::string::npos) << refused.error().message;
  EXPECT_EQ(more.display, nullptr);
}

class EndlessMemoryTest : public MemoryTest {
 protected:
  EndlessMemoryTest() : MemoryTest(std::numeric_limits<std::uint64_t>::max()) {}
};

TEST_F(EndlessMemoryTest, AFailedCreationLeavesItsPlaceAndItsMemory) {
  SessionRegistry sessions(1, timers_);
  for (int i = 0; i < 3; ++i) {
    // Longer than any vector may be.
    EXPECT_THROW((void)session(sessions, 1 << 30), std::exception);
    EXPECT_EQ(memory_.used(), of_scene_);
  }
  const auto created = session(sessions);
  EXPECT_TRUE(created.ok()) << created.error().to_string();
}

TEST_F(MemoryTest, NobodyWaitsForAChangeOfSettings) {
  std::promise<void> allocating, go_on;
  room_.instead = [&] {
    allocating.set_value();
    go_on.get_future().wait();
    return false;
  };
  auto created = session(sessions_);
  ASSERT_TRUE(created.ok());
  const std::shared_ptr<Session> session = *created;
  used_by_others_ = memory_.reserve(memory_.available(), "a test").value();
  auto update = std::async(std::launch::async, [&] {
    const pb::RenderSettings large = to_message(settings(256));
    Session::Change change;
    change.settings = &large;
    return session->update(change);
  });
  allocating.get_future().wait();
  // The limit only ends a hang: all of this waited for the film.
  auto others = std::async(std::launch::async, [&] {
    EXPECT_GT(session->idle_s(), 0);
    EXPECT_EQ(session->info().settings().width(), 16);
    EXPECT_FALSE(session->close_idle(grpc::Status::OK)) << "it is not idle while it is changed";
    const pb::View looked = view(7);
    Session::Change change;
    change.view = &looked;
    EXPECT_TRUE(session->update(change).ok());
  });
  EXPECT_EQ(others.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  go_on.set_value();
  const auto refused = update.get();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_GT(refused.error().retry_after_s, 0) << refused.error().message;
}

// A change of settings may be overtaken by a close, and then changes nothing.
TEST_F(MemoryTest, ASessionThatIsClosedMeanwhileIsNotUpdated) {
  auto created = session(sessions_);
  ASSERT_TRUE(created.ok());
  const std::shared_ptr<Session> session = *created;
  room_.instead = [&] {
    EXPECT_TRUE(sessions_.close(session->id(), "", grpc::Status::OK).ok());
    used_by_others_.release();
    return true;
  };
  used_by_others_ = memory_.reserve(memory_.available(), "a test").value();
  const pb::RenderSettings larger = to_message(settings(256));
  Session::Change change;
  change.settings = &larger;
  const auto refused = session->update(change);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::not_found);
}

TEST_F(MemoryTest, FilmsAreFreedByTheReaper) {
  // The loop holds the scene to its end; this one tells which thread let go of it last.
  std::promise<std::thread::id> freed;
  auto scene = std::make_shared<LoadedScene>();
  const SceneLease base = lease();
  scene->id = base->id;
  scene->snapshot = std::shared_ptr<const RenderScene>(
      base->snapshot.get(), [&](const RenderScene*) { freed.set_value(std::this_thread::get_id()); });
  std::weak_ptr<const LoadedScene> lives = scene;
  std::promise<std::thread::id> on_timers, on_reaper;
  timers_.call_at(0, [&] { on_timers.set_value(std::this_thread::get_id()); });
  struct Asked final : Reaper::Item {
    explicit Asked(std::promise<std::thread::id>& to) : to_(to) {}
    ~Asked() override { to_.set_value(std::this_thread::get_id()); }
    std::promise<std::thread::id>& to_;
  };
  reaper_.take(new Asked(on_reaper));
  {
    // Ended by the timer, for nobody comes.
    auto created =
        sessions_.create(resources(), SceneLease(std::move(scene)), settings(16), one_sample(), 0.02, kLimits);
    ASSERT_TRUE(created.ok());
  }
  auto thread = freed.get_future();
  ASSERT_EQ(thread.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  const std::thread::id id = thread.get();
  EXPECT_NE(id, on_timers.get_future().get());
  EXPECT_EQ(id, on_reaper.get_future().get());
  EXPECT_TRUE(lives.expired()) << "the scene could be unloaded before the film was freed";
}

// ---- scenes --------------------------------------------------------------------------------------------------------

TEST_F(MemoryTest, ASceneCountsAsLongAsAPictureHoldsIt) {
  std::shared_ptr<const RenderScene> held = lease()->snapshot;
  ASSERT_TRUE(scenes_.unload(scene_id_, "").ok());
  EXPECT_EQ(memory_.used(), of_scene_);
  held.reset();
  EXPECT_EQ(memory_.used(), 0u);
}

TEST_F(MemoryTest, ALoadReservesWhileItGoesOn) {
  ASSERT_TRUE(scenes_.unload(scene_id_, "").ok());
  EXPECT_EQ(memory_.used(), 0u);
  // Its file, its accessors and the light tables at their largest are in no finished scene.
  EXPECT_GT(memory_.peak(), of_scene_);
  // A load that is refused gives back what it had reserved.
  for (const std::uint64_t limit : {of_scene_ / 2, of_scene_ / 8}) {
    MemoryAccount small(limit);
    SceneRegistry registry(*SceneRoots::open({}), {1 << 20, 1 << 30, 100, 1}, small);
    const auto refused = registry.load(quad_request(), CancelToken());
    ASSERT_FALSE(refused.ok()) << limit;
    EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
    EXPECT_EQ(small.used(), 0u) << limit;
  }
}

// Gives one file, and tells what the ledger held when it was asked for another.
class TwoFiles final : public FileSource {
 public:
  TwoFiles(std::string gltf, const MemoryLedger& ledger) : gltf_(std::move(gltf)), ledger_(ledger) {}
  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t) const override {
    if (path == "a.gltf") return std::vector<std::uint8_t>(gltf_.begin(), gltf_.end());
    held_ = ledger_.held();
    return Error{ErrorCode::not_found, "there is none", std::string(path)};
  }
  std::uint64_t held() const { return held_; }

 private:
  const std::string gltf_;
  const MemoryLedger& ledger_;
  mutable std::uint64_t held_ = 0;
};

TEST(LoadMemory, TheLedgerKnowsWhatIsReadBeforeMoreIs) {
  std::string gltf = quad_gltf();
  const auto start = gltf.find("data:application"), end = gltf.find('"', start);
  gltf.replace(start, end - start, "a.bin");
  MemoryAccount memory(1ull << 30);
  GrowingReservation ledger(memory);
  const TwoFiles files(gltf, ledger);
  SceneLoadOptions options;
  options.ledger = &ledger;
  EXPECT_FALSE(load_scene(files, "a.gltf", options).ok());
  EXPECT_GE(files.held(), gltf.size());
}

TEST(MemoryAccountTest, WorkThatGrowsHandsOverWhatItMade) {
  MemoryAccount memory(100);
  {
    GrowingReservation work(memory);
    EXPECT_TRUE(work.grow(60));
    EXPECT_FALSE(work.grow(50));
    EXPECT_EQ(work.held(), 60u);
    work.shrink(10);
    auto made = work.split(30, "a test");
    ASSERT_TRUE(made.ok());
    EXPECT_EQ(memory.used(), 50u);
    auto more = work.split(40, "a test");  // 20 were left of it
    ASSERT_TRUE(more.ok());
    EXPECT_EQ(memory.used(), 70u);
    EXPECT_FALSE(work.split(31, "a test").ok());
    EXPECT_TRUE(work.raise_to(30));
    EXPECT_EQ(memory.used(), 100u);
  }
  EXPECT_EQ(memory.used(), 0u);
  EXPECT_EQ(memory.peak(), 100u);
  const auto never = memory.reserve(101, "a test"), later = memory.reserve(100, "a test");
  EXPECT_EQ(never.error().retry_after_s, 0) << "it is more than there ever is";
  EXPECT_TRUE(later.ok());
  EXPECT_GT(memory.reserve(1, "a test").error().retry_after_s, 0);
}

// ---- a full daemon -------------------------------------------------------------------------------------------------

class NoCall final : public OutboundStream::Call {
 public:
  void start_write(const grpc::ByteBuffer*) override {}
  void finish(const grpc::Status& status) override { finished = status; }
  std::optional<grpc::Status> finished;
};

TEST_F(MemoryTest, AFullDaemonEndsTheSessionThatNobodyHasListenedToForLongest) {
  SessionRegistry sessions(3, timers_);
  NoCall call;
  const auto stream =
      std::make_shared<OutboundStream>(call, [](Outbound) { return grpc::ByteBuffer(); }, timers_);
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    auto created = session(sessions);
    ASSERT_TRUE(created.ok());
    ids.push_back((*created)->id());
    if (i > 0) continue;
    ASSERT_TRUE((*created)->attach(stream, TileFormat()).ok());
  }
  const auto lives = [&](const std::string& id) { return sessions.find(id, "").ok(); };
  ASSERT_TRUE(session(sessions).ok());
  EXPECT_TRUE(lives(ids[0])) << "it has a listener";
  EXPECT_FALSE(lives(ids[1])) << "it was the oldest without one";
  EXPECT_TRUE(lives(ids[2]));
  // One that was listened to meanwhile is not the oldest any more.
  (*sessions.find(ids[0], ""))->detach(stream.get());
  ASSERT_TRUE(session(sessions).ok());
  EXPECT_TRUE(lives(ids[0]));
  EXPECT_FALSE(lives(ids[2]));
}

TEST_F(MemoryTest, SessionsWithoutAListenerMakeRoomForAFilm) {
  std::vector<std::string> ids;
  for (int i = 0; i < 4; ++i) {
    auto created = session(sessions_, 256);
    ASSERT_TRUE(created.ok());
    ids.push_back((*created)->id());
  }
  const Reservation others = memory_.reserve(memory_.available(), "a test").value();
  // Ending all of them would not free enough: none is ended in vain.
  const auto refused = session(sessions_, 1024);
  ASSERT_FALSE(refused.ok());
  EXPECT_GT(refused.error().retry_after_s, 0);
  EXPECT_EQ(sessions_.list().size(), 4u);
  ASSERT_TRUE(session(sessions_, 300).ok());
  EXPECT_FALSE(sessions_.find(ids[0], "").ok());
  EXPECT_FALSE(sessions_.find(ids[1], "").ok());
  EXPECT_TRUE(sessions_.find(ids[2], "").ok());
  EXPECT_TRUE(sessions_.find(ids[3], "").ok());
}

// A full account, most of it held by a session to which nobody listens.
class FullMemoryTest : public MemoryTest {
 protected:
  void SetUp() override {
    MemoryTest::SetUp();
    idle_ = session(sessions_, 512).value()->id();
  }
  void fill() { others_.push_back(memory_.reserve(memory_.available(), "a test").value()); }
  bool lives(const std::string& id) const { return sessions_.find(id, "").ok(); }
  static SceneRequest another_request() {
    SceneRequest request = quad_request();
    request.environment = "1,2,3";
    return request;
  }
  Result<SceneRegistry::Outcome> edit(float roughness) {
    MaterialEdit edit;
    edit.target = 0u;
    edit.roughness = roughness;
    return scenes_.edit(lease(), std::vector<SceneEdit>{edit}, CancelToken());
  }

  std::string idle_;
  std::vector<Reservation> others_;
};

TEST_F(FullMemoryTest, RoomIsMadeForALoad) {
  fill();
  const auto loaded = scenes_.load(another_request(), CancelToken());
  ASSERT_TRUE(loaded.ok()) << loaded.error().to_string();
  EXPECT_FALSE(lives(idle_));
}

TEST_F(FullMemoryTest, RoomIsMadeForAnEditAndFirstOfEditsThatNobodyUses) {
  std::vector<std::string> edits;
  for (int i = 0; i < 20; ++i) edits.push_back(edit(0.01f * float(i)).value().scene->id);
  fill();
  ASSERT_TRUE(edit(0.5f).ok());
  EXPECT_FALSE(scenes_.find(edits.front(), "").ok());
  EXPECT_TRUE(scenes_.find(edits.back(), "").ok()) << "the others had the room";
  EXPECT_TRUE(lives(idle_)) << "edits had the room";
  std::vector<SceneLease> used;
  for (auto& scene : scenes_.list()) used.emplace_back(std::move(scene));
  fill();
  ASSERT_TRUE(edit(0.3f).ok());
  EXPECT_FALSE(lives(idle_));
}

TEST_F(FullMemoryTest, RoomIsMadeForAnUpload) {
  fill();
  BundleReceiver upload(1 << 20, memory_);
  pb::LoadSceneRequest::Begin begin;
  begin.set_main_file("a.gltf");
  begin.set_total_bytes(100000);
  ASSERT_TRUE(upload.begin(begin).ok());
  EXPECT_FALSE(lives(idle_));
}

TEST_F(FullMemoryTest, RoomIsMadeForAListenerNotByEndingItsOwnSession) {
  const std::string small = session(sessions_, 16).value()->id();
  fill();
  NoCall call;
  const auto stream =
      std::make_shared<OutboundStream>(call, [](Outbound) { return grpc::ByteBuffer(); }, timers_);
  const std::shared_ptr<Session> own = *sessions_.find(idle_, "");  // the one that would be ended first
  EXPECT_FALSE(own->attach(stream, TileFormat()).ok());
  EXPECT_TRUE(lives(idle_));
  EXPECT_TRUE(lives(small)) << "it has less than the queue needs";
  others_.clear();
  const std::string large = session(sessions_, 512).value()->id();
  fill();
  ASSERT_TRUE(own->attach(stream, TileFormat()).ok());
  EXPECT_TRUE(lives(idle_));
  EXPECT_FALSE(lives(large));
  own->detach(stream.get());
}

TEST_F(FullMemoryTest, WhatIsMoreThanAllOfItEndsNobody) {
  const std::string edited = edit(0.1f).value().scene->id;
  fill();
  EXPECT_FALSE(memory_.reserve_with_room(memory_.limit() + 1, "a test").ok());
  EXPECT_FALSE(memory_.reserve_with_room(memory_.obtainable() + 1, "a test").ok());
  EXPECT_TRUE(lives(idle_));
  EXPECT_TRUE(scenes_.find(edited, "").ok());
  EXPECT_TRUE(memory_.reserve_with_room(memory_.obtainable(), "a test").ok());
  EXPECT_FALSE(lives(idle_));
}

TEST_F(MemoryTest, ASessionWithoutAListenerReservesNoQueue) {
  SessionRegistry sessions(1, timers_);
  NoCall call;
  const auto stream =
      std::make_shared<OutboundStream>(call, [](Outbound) { return grpc::ByteBuffer(); }, timers_);
  auto created = session(sessions);
  ASSERT_TRUE(created.ok());
  const std::uint64_t alone = memory_.used();
  ASSERT_TRUE((*created)->attach(stream, TileFormat()).ok());
  EXPECT_GT(memory_.used(), alone);
  (*created)->detach(stream.get());
  EXPECT_EQ(memory_.used(), alone);
}

}  // namespace
}  // namespace helio::test
