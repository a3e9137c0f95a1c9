#include "server/jobs/session_record.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "renderer/frame/checkpoint/picture_head.h"
#include "server/jobs/session_record.pb.h"
#include "server/state/sealed_message.h"

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
  view.gaze = Gaze{12.5, -3};
  const auto pose = look_at({1, 2.0 / 3, -7.1}, {0.3, 1e-9, 4}, {0, 1, 0}, 0.7);
  view.camera = *pose;
  view.camera.lens_radius = 0.1;
  view.camera.aspect = 4.0 / 3;
  view.camera.position.z = -0.0;
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
  EXPECT_TRUE(read->view->gaze == record.view->gaze);
  EXPECT_EQ(read->view->camera, record.view->camera);
  EXPECT_TRUE(std::signbit(read->view->camera.position.z));
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
  refused("", "its record is damaged: it has 0 bytes");
  for (std::size_t size = 1; size < whole.size(); ++size) refused(whole.substr(0, size), "its record is damaged");
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string flipped = whole;
    flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
    refused(flipped, "its record ");
  }
  refused("\xa9""fbudget", "its record has version 1; this program reads version 2");  // CBOR of daemons before
  heliograph::kept::SessionRecord message;
  ASSERT_TRUE(unseal(whole, 2, message).ok());
  const auto sealed = [&](std::uint32_t version) {
    const auto bytes = seal(message, version);
    return std::string(bytes.begin(), bytes.end());
  };
  EXPECT_TRUE(SessionRecord::read(sealed(2), kLimits).ok());
  refused(sealed(3), "its record has version 3; this program reads version 2");
  message.mutable_settings()->set_mode(heliograph::v1::Mode(99));
  refused(sealed(2), "settings.mode");
  SessionRecord changed = record;
  changed.grace_s = 0;
  refused(changed.write(), "grace_s: 0");
  changed = record;
  changed.view->camera.position.y = std::numeric_limits<double>::quiet_NaN();
  refused(changed.write(), "view.");
  changed = record;
  changed.view->id = 0;
  refused(changed.write(), "view.id: 0");
  SessionRecord large = record;
  large.settings.width = 1025;
  refused(large.write(), "settings.width: 1025");
}

}  // namespace
}  // namespace helio
