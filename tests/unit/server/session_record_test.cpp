#include "server/jobs/session_record.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "renderer/frame/checkpoint/picture_head.h"

namespace helio {
namespace {

const RenderLimits kLimits{1024, 1 << 20};

SessionRecord some_record() {
  SessionRecord record;
  record.scene_id = "a scene";
  record.settings.width = 40;
  record.settings.height = 30;
  record.settings.mode = RenderMode::adaptive;
  record.settings.integrator = Integrator::pt_bdpt;
  record.settings.seed = 0xfedcba9876543210;
  record.settings.region = PixelRect{3, 4, 33, 29};
  record.settings.preview.rate = 20;
  record.budget.samples = 77;
  record.budget.error = 0.1;
  record.grace_s = 60;
  record.kept_s = 1764359000.25;
  record.build = "this one";
  View view;
  view.id = (1ull << 62) + 1;
  view.exposure = -1.5;
  const auto pose = look_at({1, 2.0 / 3, -7.1}, {0.3, 1e-9, 4}, {0, 1, 0}, 0.7);
  view.camera = *pose;
  view.camera.lens_radius = 0.1;
  view.camera.aspect = 4.0 / 3;
  record.view = view;
  return record;
}

// Settings and camera come back to the bit: samples of a checkpoint suit them only then.
TEST(SessionRecord, ComesBackAsItWas) {
  const SessionRecord record = some_record();
  const auto read = SessionRecord::read(record.write(), kLimits);
  ASSERT_TRUE(read.ok()) << read.error().to_string();
  EXPECT_EQ(read->scene_id, record.scene_id);
  EXPECT_EQ(settings_digest(read->settings), settings_digest(record.settings));
  EXPECT_EQ(read->settings.preview.rate, 20);
  EXPECT_TRUE(read->budget == record.budget);
  EXPECT_EQ(read->grace_s, 60);
  EXPECT_EQ(read->kept_s, record.kept_s);
  EXPECT_EQ(read->build, record.build);
  EXPECT_EQ(read->without, "");
  ASSERT_TRUE(read->view);
  EXPECT_EQ(read->view->id, record.view->id);
  EXPECT_EQ(read->view->exposure, record.view->exposure);
  EXPECT_EQ(read->view->camera, record.view->camera);
  SessionRecord bare = record;
  bare.view.reset();
  bare.without = "the disk is full";
  const auto again = SessionRecord::read(bare.write(), kLimits);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->view);
  EXPECT_EQ(again->without, bare.without);
}

TEST(SessionRecord, RefusesWhatIsNone) {
  const auto refused = [](const std::string& bytes, const std::string& why) {
    const auto read = SessionRecord::read(bytes, kLimits);
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().to_string().find(why), std::string::npos) << read.error().to_string();
  };
  const SessionRecord record = some_record();
  const std::string whole = record.write();
  refused("", "parse error");
  for (std::size_t size = 1; size < whole.size(); size += 7) refused(whole.substr(0, size), "");
  auto json = nlohmann::json::from_cbor(whole);
  const auto with = [&](const std::string& key, nlohmann::json value) {
    auto changed = json;
    changed[key] = std::move(value);
    const auto bytes = nlohmann::json::to_cbor(changed);
    return std::string(bytes.begin(), bytes.end());
  };
  refused(with("version", 2), "has version 2; this program reads version 1");
  refused(with("grace_s", 0), "grace_s: 0");
  refused(with("settings", nlohmann::json::binary({255, 255})), "a message cannot be read");
  auto view = json["view"];
  view["position"][1] = std::numeric_limits<double>::quiet_NaN();
  refused(with("view", view), "view.");
  view = json["view"];
  view["id"] = 0;
  refused(with("view", view), "view.id: 0");
  SessionRecord large = record;
  large.settings.width = 1025;
  refused(large.write(), "settings.width: 1025");
}

}  // namespace
}  // namespace helio
