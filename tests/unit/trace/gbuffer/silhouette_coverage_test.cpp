// What the rims of pixels show.
#include "renderer/trace/gbuffer/silhouette_coverage.h"

#include <gtest/gtest.h>

#include <vector>

#include "renderer/trace/gbuffer/primary_hits.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kSide = 8;

// A wall, and before it a post whose right side stands at the column `edge` of a picture of kSide pixels, its top at
// the row `top` from above.
class APost {
 public:
  APost(float edge, float top) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
    add_mesh(scene, quad({-40, -40, -1}, {80, 0, 0}, {0, 80, 0}, 0));
    add_mesh(scene, quad({-40, -40, 0}, {40 + edge - kSide / 2, 0, 0}, {0, 40 + kSide / 2 - top, 0}, 0));
    scene_ = build(scene);
    pose_ = camera_at({0, 0, 4}, {0, 0, 0});
    pose_.projection = Projection::orthographic;
    pose_.half_height = 0.5 * kSide;
    const Camera camera(pose_, kSide, kSide, scene_->origin());
    const PixelRect window = {0, 0, kSide, kSide};
    PrimaryHits centres(*scene_, camera, pose_.forward);
    centres.trace(window);
    const CameraProjection projection(pose_, kSide, kSide, scene_->origin());
    SurfaceSteps steps(projection);
    const SilhouetteCoverage rims(*scene_, camera, pose_.forward, window, std::vector<std::uint8_t>(kSide * kSide, 1));
    EXPECT_EQ(rims.rays(), (2u * kSide + 1) * (2 * kSide + 1) - kSide * kSide) << "shared by neighbours";
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) pure_.push_back(rims.show_only(centres.at(x, y), x, y, steps));
    }
  }

  bool pure(int x, int y) const { return pure_[std::size_t(y) * kSide + std::size_t(x)]; }

 private:
  std::shared_ptr<const RenderScene> scene_;
  CameraPose pose_;
  std::vector<bool> pure_;
};

TEST(SilhouetteCoverage, PixelsThatAnEdgeCrossesAreNotPureAndTheirNeighboursAre) {
  for (const float edge : {3.1f, 3.4f, 3.6f, 3.9f}) {
    const APost post(edge, 0);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) EXPECT_EQ(post.pure(x, y), x != 3) << edge << " at " << x << ", " << y;
    }
  }
}

TEST(SilhouetteCoverage, ACornerThatReachesIntoAPixelIsSeen) {
  for (const float into : {0.1f, 0.4f, 0.6f, 0.9f}) {
    const APost post(3 + into, 5 - into);
    EXPECT_FALSE(post.pure(3, 4)) << into;
    EXPECT_TRUE(post.pure(4, 3) && post.pure(2, 6) && post.pure(4, 4) && post.pure(3, 3)) << into;
  }
}

TEST(SilhouetteCoverage, OnlyWhatIsAskedForIsTraced) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-40, -40, 0}, {80, 0, 0}, {0, 80, 0}, 0));
  const auto built = build(scene);
  const CameraPose pose = camera_at({0, 0, 4}, {0, 0, 0});
  const Camera camera(pose, kSide, kSide, built->origin());
  std::vector<std::uint8_t> asked(4 * 3, 0);
  EXPECT_EQ(SilhouetteCoverage(*built, camera, pose.forward, {2, 3, 6, 6}, asked).rays(), 0u);
  asked[5] = 1;
  EXPECT_EQ(SilhouetteCoverage(*built, camera, pose.forward, {2, 3, 6, 6}, asked).rays(), 8u);
}

}  // namespace
}  // namespace helio::test
