// The error that a picture reports against the error that it has: over 20 seeds, the picture and nine tenths of its
// tiles must lie within [0.8, 1.25] of the truth.
//
// The truth needs no reference: picture i is compared with the mean m of the other 19, E |x_i - m|^2 = (20 / 19) s^2.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "renderer/film/estimate/resolve.h"
#include "tests/support/own_scenes.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

constexpr int kSeeds = 20, kTile = 32, kTiles = 3, kSide = kTile * kTiles;
constexpr std::size_t kPixels = std::size_t(kSide) * kSide;

struct Picture {
  std::vector<float> radiance[3], variance[3];
};

Picture render_picture(const RenderScene& scene, std::uint64_t seed, std::uint32_t samples) {
  PathSettings settings;
  settings.seed = seed;
  const Film film =
      render(scene, camera_pose(scene.description().cameras.at(0)), kSide, kSide, samples / kHalves, settings);
  ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), kResolveVariance);
  Picture picture;
  for (int c = 0; c < 3; ++c) {
    picture.radiance[c] = std::move(tile.radiance[c]);
    picture.variance[c] = std::move(tile.variance[c]);
  }
  return picture;
}

struct Errors {
  double reported = 0, truth = 0;  // sums of variances, of squared errors
  double ratio() const { return std::sqrt(reported / truth); }
};

// Open to the sky, with a sun: hard shadows, and parts that see nothing at all.
SceneDescription courtyard() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.6f, 0.5f, 0.4f)), lambert(Rgb(0.2f, 0.3f, 0.7f))};
  add_mesh(scene, quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0));
  add_mesh(scene, quad({-4, 0, -4}, {8, 0, 0}, {0, 3, 0}, 0));
  add_mesh(scene, box({-1.5f, 0, -1}, {-0.5f, 2, 0}, 1));
  add_sphere(scene, {1, 0.8f, 0}, 0.8f, 1);
  PunctualLight sun;
  sun.kind = PunctualKind::directional;
  sun.direction = normalize(V3d(-0.5, -1, -0.3));
  sun.intensity = Rgb(3, 2.8f, 2.5f);
  scene.lights = {sun};
  Environment sky;
  sky.radiance = Rgb(0.3f, 0.5f, 0.9f);
  scene.environment = sky;
  CameraDescription camera;
  camera.name = "camera";
  camera.to_world.setTranslation(V3d(0, 1.2, 6));
  scene.cameras = {camera};
  return scene;
}

struct Case {
  const char* scene;
  std::uint32_t samples;
  bool in_short_tier = false;
};

class Calibration : public testing::TestWithParam<Case> {};

TEST_P(Calibration, ReportedErrorIsTheTrueError) {
  if (!GetParam().in_short_tier) HELIO_FULL_TIER_ONLY();
  const bool own = std::string(GetParam().scene) != "courtyard";
  const auto scene = own ? load_own_scene(GetParam().scene) : build(courtyard());
  ASSERT_TRUE(scene);
  std::vector<Picture> pictures;
  for (int s = 0; s < kSeeds; ++s) pictures.push_back(render_picture(*scene, 1000 + std::uint64_t(s), GetParam().samples));

  Errors tiles[kTiles][kTiles], whole;
  std::vector<Errors> of_pictures(pictures.size());
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < kPixels; ++i) {
      double sum = 0;
      for (const Picture& p : pictures) sum += p.radiance[c][i];
      Errors& tile = tiles[i / kSide / kTile][i % kSide / kTile];
      for (std::size_t s = 0; s < pictures.size(); ++s) {
        const Picture& p = pictures[s];
        const double x = p.radiance[c][i], others = (sum - x) / (kSeeds - 1);
        const double squared = (x - others) * (x - others) * (kSeeds - 1) / kSeeds;
        tile.truth += squared;
        tile.reported += double(p.variance[c][i]);
        of_pictures[s].truth += squared;
        of_pictures[s].reported += double(p.variance[c][i]);
      }
    }
  }
  double least = 1e9, most = 0;
  for (const Errors& picture : of_pictures) {
    whole.truth += picture.truth;
    whole.reported += picture.reported;
    least = std::min(least, picture.ratio());
    most = std::max(most, picture.ratio());
  }
  double lowest = 1e9, highest = 0;
  int good = 0, count = 0;
  for (const auto& row : tiles) {
    for (const Errors& tile : row) {
      // A tile without noise of its own reports what is pooled across its rim: very little, but not nothing.
      if (tile.truth < 1e-4 * whole.truth / (kTiles * kTiles)) {
        EXPECT_LT(tile.reported, 1e-2 * whole.reported / (kTiles * kTiles));
        continue;
      }
      ++count;
      good += tile.ratio() >= 0.8 && tile.ratio() <= 1.25;
      lowest = std::min(lowest, tile.ratio());
      highest = std::max(highest, tile.ratio());
    }
  }
  std::printf(
      "%s: reported over true error %.3f, of single pictures %.3f to %.3f; tiles %.3f to %.3f, %d of %d within "
      "[0.8, 1.25]\n",
      GetParam().scene, whole.ratio(), least, most, lowest, highest, good, count);
  EXPECT_GE(whole.ratio(), 0.8);
  EXPECT_LE(whole.ratio(), 1.25);
  EXPECT_GE(good, 0.9 * count);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Calibration,
                         testing::Values(Case{"cornell-box", 32, true}, Case{"cornell-glossy", 32}, Case{"cornell-spheres", 32, true},
                                         Case{"cornell-covered", 32}, Case{"veach-plates", 64}, Case{"courtyard", 32}),
                         [](const auto& info) { return test_name_of(info.param.scene); });

}  // namespace
}  // namespace helio::test
