// References are made once for every scene, view and setting, and are not what any run renders.
#include "tests/bench/scenes/reference_pictures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <string>

#include "tests/support/small_rooms.h"

namespace helio::bench {
namespace {

namespace fs = std::filesystem;

class ReferencePictures : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    request_.name = "room";
    request_.scene_checksum = 17;
    request_.scene = test::build(test::lambert_room());
    ASSERT_TRUE(request_.scene);
    request_.view = test::camera_at({0, 0, 0.9}, {0, -0.2, -1}, 60);
    request_.settings.width = 16;
    request_.settings.height = 12;
    request_.samples = 64;
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Of the test alone: others run at the same time.
  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("helio_references_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  ReferenceRequest request_;
};

TEST_F(ReferencePictures, AreRenderedOnceAndThenRead) {
  RenderEngine engine(2);
  const auto made = reference_picture(engine, folder_, request_);
  ASSERT_TRUE(made.ok()) << made.error().to_string();
  const fs::path file = reference_file(folder_, request_);
  const auto written = fs::last_write_time(file);
  request_.scene = nullptr;  // a second rendering would need it
  const auto read = reference_picture(engine, folder_, request_);
  ASSERT_TRUE(read.ok()) << read.error().to_string();
  EXPECT_EQ(fs::last_write_time(file), written);
  EXPECT_GT(mean_of(read->variance), 0);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(read->picture.channels[c], made->picture.channels[c]);
    EXPECT_EQ(read->variance.channels[c], made->variance.channels[c]);
    // Pixel (1, 1)'s variance is the mean of the noise there and around.
    const auto width = std::size_t(read->picture.width);
    double noise = 0;
    for (std::size_t y = 0; y < 3; ++y) {
      for (std::size_t x = 0; x < 3; ++x) noise += double(read->noise.channels[c][y * width + x]) / 9;
    }
    const double variance = read->variance.channels[c][width + 1];
    EXPECT_NEAR(noise, variance, 1e-6 * variance);
  }
}

// From seeds of their own, as plain path tracing, and no darker or brighter than a run: within 4 standard errors of the
// difference of two means whose pixels have the mean variance of the reference (the run's is twice that, at half its
// samples).
TEST_F(ReferencePictures, ShareNoSeedWithRunsAndAgreeWithThem) {
  RenderEngine engine(2);
  request_.settings.mode = RenderMode::adaptive;
  request_.settings.variant = ModeVariant::paper;
  const auto reference = reference_picture(engine, folder_, request_);
  ASSERT_TRUE(reference.ok()) << reference.error().to_string();
  RenderSettings settings = request_.settings;
  settings.mode = RenderMode::pt;
  const auto run = render_picture(engine, request_.scene, settings, request_.samples / 2, request_.view);
  ASSERT_TRUE(run.ok()) << run.error().to_string();
  EXPECT_NE(run->channels[0], reference->picture.channels[0]);
  const double error = std::sqrt(3 * mean_of(reference->variance) / double(run->view().pixels()));
  EXPECT_NEAR(mean_of(*run), mean_of(reference->picture), 4 * error);
}

TEST_F(ReferencePictures, HaveAFileForEachSceneViewAndSetting) {
  using Change = std::function<void(ReferenceRequest&)>;
  const Change changes[] = {
      [](ReferenceRequest&) {},
      [](ReferenceRequest& r) { r.name = "hall"; },
      [](ReferenceRequest& r) { r.scene_checksum = 18; },
      [](ReferenceRequest& r) { r.samples = 128; },
      [](ReferenceRequest& r) { r.view.position.x += 1e-12; },
      [](ReferenceRequest& r) { r.view.up = -r.view.up; },
      [](ReferenceRequest& r) { r.view.vertical_fov *= 1.01; },
      [](ReferenceRequest& r) { r.view.lens_radius = 0.1; },
      [](ReferenceRequest& r) { r.view.projection = Projection::orthographic; },
      [](ReferenceRequest& r) { std::swap(r.settings.width, r.settings.height); },
      [](ReferenceRequest& r) { r.settings.max_segments = 5; },
      [](ReferenceRequest& r) { r.settings.roulette_from = 5; },
      [](ReferenceRequest& r) { r.settings.filter.kind = PixelFilterKind::tent; },
      [](ReferenceRequest& r) {
        r.settings.region = PixelRect{0, 0, 8, 8};
      },
  };
  std::set<fs::path> files;
  for (const Change& change : changes) {
    ReferenceRequest request = request_;
    change(request);
    files.insert(reference_file(folder_, request));
  }
  EXPECT_EQ(files.size(), std::size(changes));
  // What does not count: who compares with it.
  ReferenceRequest same = request_;
  same.settings.mode = RenderMode::adaptive;
  same.settings.seed = 5;
  EXPECT_EQ(reference_file(folder_, same), reference_file(folder_, request_));
}

TEST_F(ReferencePictures, SayWhereTheyCannotBeKept) {
  RenderEngine engine(1);
  const auto refused = reference_picture(engine, "/proc/none", request_);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().to_string().find("/proc/none"), std::string::npos);
}

}  // namespace
}  // namespace helio::bench
