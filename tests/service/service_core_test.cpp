// The end of the daemon while a timer's function is in hand.
#include "server/sessions/service_core.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "tests/support/small_rooms.h"

namespace helio {
namespace {

TEST(ServiceCore, TimersStopBeforeWhatTheyUseIsDestroyed) {
  std::weak_ptr<LoadedScene> held;
  std::promise<void> started;
  bool alive = false;
  {
    ServerConfig config;
    config.render_threads = 1;
    ServiceCore core(complete(config), *SceneRoots::open({}));
    const auto scene = std::make_shared<LoadedScene>();
    scene->snapshot = test::build(test::lambert_room());
    held = scene;
    RenderSettings settings;
    settings.width = settings.height = 16;
    const auto session =
        core.sessions.create(core.resources(), SceneLease(scene), settings, {}, /*grace_s=*/1e6, core.render_limits());
    ASSERT_TRUE(session) << session.error().to_string();
    core.timers.call_at(0, [&] {
      started.set_value();
      for (int i = 0; i < 100 && !held.expired(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      alive = !held.expired();
    });
    started.get_future().wait();
  }
  EXPECT_TRUE(alive) << "the sessions were destroyed beside a timer's function";
  EXPECT_TRUE(held.expired());
}

// What becomes of a session while the daemon drains: it is copied as it was, whatever is asked of it meanwhile.
TEST(ServiceCore, AFrozenSessionTakesNothingAndGivesItsPicture) {
  ServerConfig config;
  config.render_threads = 2;
  ServiceCore core(complete(config), *SceneRoots::open({}));
  const auto scene = std::make_shared<LoadedScene>();
  scene->id = "a scene";
  scene->snapshot = test::build(test::lambert_room());
  RenderSettings settings;
  settings.width = settings.height = 32;
  Budget budget;
  budget.samples = 8;
  const auto made = core.sessions.create(core.resources(), SceneLease(scene), settings, budget, 1e6,
                                         core.render_limits());
  ASSERT_TRUE(made) << made.error().to_string();
  Session& session = **made;
  const auto none = session.copy_picture(now_s() + 10);
  ASSERT_TRUE(none) << none.error().to_string();
  EXPECT_EQ(*none, nullptr) << "there is no view";

  heliograph::v1::View view;
  view.set_id(1);
  view.mutable_camera()->mutable_position()->set_z(0.9);
  view.mutable_camera()->mutable_look_at()->mutable_target();
  Session::Change change;
  change.view = &view;
  ASSERT_TRUE(session.update(change));
  while (session.info().progress().samples_per_pixel() < 8) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  session.freeze("it restarts");
  view.set_id(2);
  const auto refused = session.update(change);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
  EXPECT_GT(refused.error().retry_after_s, 0);
  EXPECT_FALSE(session.close_idle(grpc::Status::OK)) << "it is about to be kept";

  const Session::State state = session.state();
  ASSERT_TRUE(state.view);
  EXPECT_EQ(state.view->id, 1u);
  EXPECT_EQ(state.budget.samples, 8u);
  EXPECT_FALSE(state.attached);
  const auto picture = session.copy_picture(now_s() + 10);
  ASSERT_TRUE(picture) << picture.error().to_string();
  ASSERT_NE(*picture, nullptr);
  EXPECT_EQ((*picture)->samples(), 8u * 32 * 32) << "no sample more, and none less";
  EXPECT_TRUE((*picture)->suits(state.settings, *state.view).ok());
}

TEST(ServiceCore, AnExpectedSessionIsWaitedFor) {
  ServerConfig config;
  config.render_threads = 1;
  ServiceCore core(complete(config), *SceneRoots::open({}));
  core.sessions.expect("s-soon");
  const auto soon = core.sessions.find("s-soon", "session_id");
  ASSERT_FALSE(soon);
  EXPECT_EQ(soon.error().code, ErrorCode::unavailable);
  EXPECT_GT(soon.error().retry_after_s, 0);
  EXPECT_EQ(core.sessions.close("s-soon", "session_id", grpc::Status::OK).error().code, ErrorCode::unavailable);
  core.sessions.expect_no_more("s-soon");
  EXPECT_EQ(core.sessions.find("s-soon", "session_id").error().code, ErrorCode::not_found);
  // Ids of a daemon tell nothing about those of the next: 96 random bits each.
  EXPECT_EQ(make_id("s-").size(), 2u + 24u);
  EXPECT_NE(make_id("s-"), make_id("s-"));
}

}  // namespace
}  // namespace helio
