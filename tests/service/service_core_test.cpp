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

}  // namespace
}  // namespace helio
