// The hall has the lamps that it is said to have, and shows a tenth of them.
#include "tests/bench/scenes/lamp_hall.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "renderer/trace/camera/camera.h"
#include "tests/support/test_scenes.h"

namespace helio::bench {
namespace {

TEST(LampHall, HasItsLampsAndShowsATenthOfThem) {
  for (const int lamps : {100, 10000}) {
    const SceneDescription scene = lamp_hall(lamps);
    const CameraPose pose = camera_pose(scene.cameras.at(0));
    const double up = std::tan(scene.cameras[0].vertical_fov / 2), across = up * 16 / 9;
    double weakest = INFINITY, strongest = 0, area = 0;
    int seen = 0, all = 0;
    for (const Object& object : scene.objects) {
      for (const TriangleMesh& mesh : object.meshes) {
        const float radiance = scene.materials.at(std::size_t(mesh.material)).emission.x;
        if (!(radiance > 0)) continue;
        weakest = std::min(weakest, double(radiance));
        strongest = std::max(strongest, double(radiance));
        for (std::size_t i = 0; i < mesh.positions.size(); i += 4) {
          const V3f side = mesh.positions[i + 1] - mesh.positions[i];
          area += double(length_squared(side));
          const V3d at = V3d(mesh.positions[i]) - pose.position;
          EXPECT_LT(cross(side, mesh.positions[i + 2] - mesh.positions[i + 1]).y, 0) << "faces up";
          seen += at.z > 0 && std::abs(at.y) < up * at.z && std::abs(at.x) < across * at.z;
          ++all;
        }
      }
    }
    EXPECT_EQ(all, lamps);
    EXPECT_NEAR(strongest / weakest, 1000, 1);
    EXPECT_NEAR(area, 64, 1e-2);
    EXPECT_NEAR(double(seen) / all, 0.11, 0.04) << lamps;
  }
}

TEST(LampHall, IsLitByOneLampAsWell) {
  const auto scene = test::build(lamp_hall(1));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->features().light_count, 2u);  // triangles
  const CameraPose pose = camera_pose(scene->description().cameras.at(0));
  const test::MeanEstimate mean = test::mean_of(test::render(*scene, pose, 32, 18, 16));
  for (int c = 0; c < 3; ++c) EXPECT_GT(mean.mean[c], 3 * mean.standard_error[c]) << c;
}

}  // namespace
}  // namespace helio::bench
