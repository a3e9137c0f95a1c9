// What samples find out about their pixels, and what becomes of history where they do.
#include "renderer/trace/mixed_pixels.h"

#include <gtest/gtest.h>

#include <utility>

#include "renderer/film/film_history.h"
#include "renderer/trace/picture_centres.h"
#include "renderer/trace/reprojection.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 24, kHeight = 16;
constexpr float kPixel = 1.0f / 16;  // on the plane z = 0
constexpr int kX = 9, kY = 5;        // of the pixel that something is put into

const Material kGrey = lambert(Rgb(0.5f, 0.5f, 0.5f));

CameraPose before_wall(double aside = 0) {
  CameraPose pose = camera_at({aside * double(kPixel), 0, 4}, {aside * double(kPixel), 0, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 0.5 * kHeight * double(kPixel);
  return pose;
}

// A point of the pixel on the plane, from its upper left corner.
V3f point_of(float in_x, float in_y, float z = 0) {
  return {(float(kX) + in_x - kWidth / 2) * kPixel, (kHeight / 2 - float(kY) - in_y) * kPixel, z};
}

// 0.3 pixels square, between the pixel's centre, the middles of its sides and its corners.
TriangleMesh speck(float z, int material) {
  return quad(point_of(0.1f, 0.4f, z), {0.3f * kPixel, 0, 0}, {0, 0.3f * kPixel, 0}, material);
}

TriangleMesh wall() {
  return quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0);
}

// A film that knows what its centres meet.
Film film_before(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose) {
  Film film(kWidth, kHeight, {.history = true});
  PictureCentres centres(scene, film, film.bounds(), pose, {});
  centres.find(film.bounds());
  centres.find_borders(film.bounds());
  centres.settle(film.bounds());
  return film;
}

void trace(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, int half, std::uint32_t samples,
           Film& film, const CancelToken& cancel = {}) {
  const Camera camera(pose, kWidth, kHeight, scene->origin());
  TraceStats stats;
  trace_window(*scene, camera, {}, {half, 0, samples}, film.bounds(), cancel, film, stats);
}

// Of pixels inside surfaces, those that are mixed, as x + width * y.
std::vector<int> mixed_of(const Film& film) {
  std::vector<int> found;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (film.history()->carried(x, y).mixed()) found.push_back(x + kWidth * y);
    }
  }
  return found;
}

const std::vector<int> kOne = {kX + kWidth * kY};

TEST(MixedPixels, AreFoundByWhatIsSmallerThanAPixel) {
  SceneDescription lamp, leaf, ridge, nothing;
  for (SceneDescription* scene : {&lamp, &leaf, &ridge, &nothing}) scene->materials = {kGrey, lambert(Rgb(0), Rgb(9))};
  add_mesh(lamp, wall());
  add_mesh(lamp, speck(0.01f * kPixel, 1));
  // Of one object: a step of two pixels, and a ridge less than half a pixel high.
  Object leaves, ridges;
  leaves.meshes = {wall(), speck(2 * kPixel, 0)};
  add_instance(leaf, add_object(leaf, std::move(leaves)));
  const V3f foot = point_of(0.1f, 0.4f), along(0.3f * kPixel, 0, 0);
  ridges.meshes = {wall(), quad(foot, along, {0, 0.15f * kPixel, 0.3f * kPixel}, 0)};
  add_instance(ridge, add_object(ridge, std::move(ridges)));
  // A speck, and nothing around it.
  add_mesh(nothing, speck(0, 0));
  for (const SceneDescription& description : {lamp, leaf, ridge, nothing}) {
    const auto scene = build(description);
    for (int half = 0; half < kHalves; ++half) {
      Film film = film_before(scene, before_wall());
      EXPECT_FALSE(film.history()->centre(kX, kY).border);
      trace(scene, before_wall(), half, 64, film);
      EXPECT_EQ(mixed_of(film), kOne);
    }
  }
}

TEST(MixedPixels, AreNoneOfOneSurface) {
  SceneDescription ball, slope, chip, pane;
  ball.materials = slope.materials = chip.materials = {kGrey};
  pane.materials = {kGrey, kGrey};
  pane.materials[1].alpha_mode = AlphaMode::blend;
  pane.materials[1].base_alpha = 0.5f;
  add_mesh(pane, wall());
  add_mesh(pane, quad({-20, -20, 1}, {40, 0, 0}, {0, 40, 0}, 1));
  Object sphere;
  sphere.spheres.push_back({V3f(0, 0, 0), 0.4f, 0});
  add_instance(ball, add_object(ball, std::move(sphere)));
  add_mesh(slope, quad({-20, -20, -420}, {40, 0, 0}, {0, 40, 800}, 0));  // seen at 3 degrees
  Object chips;
  chips.meshes = {wall(), speck(0.5f * kPixel, 0)};
  add_instance(chip, add_object(chip, std::move(chips)));
  for (const SceneDescription& description : {ball, slope, chip, pane}) {
    const auto scene = build(description);
    Film film = film_before(scene, before_wall());
    trace(scene, before_wall(), 0, 32, film);
    EXPECT_EQ(mixed_of(film), std::vector<int>());
  }
}

TEST(MixedPixels, AreNotToldWhereCentresAreNotKnown) {
  SceneDescription description;
  description.materials = {kGrey, lambert(Rgb(0), Rgb(9))};
  add_mesh(description, wall());
  add_mesh(description, speck(0.01f * kPixel, 1));
  const auto scene = build(description);
  Film film = film_before(scene, before_wall());
  film.clear();
  EXPECT_FALSE(film.history()->centre(kX, kY).known());
  trace(scene, before_wall(), 0, 64, film);
  EXPECT_EQ(mixed_of(film), std::vector<int>());

  Film cancelled = film_before(scene, before_wall());
  CancelToken token;
  token.cancel();
  trace(scene, before_wall(), 0, 64, cancelled, token);
  EXPECT_EQ(mixed_of(cancelled), std::vector<int>());
}

// A lamp that is smaller than a pixel is not smeared over those that look its pixel up, and comes back where that is
// kept as it was.
TEST(MixedPixels, AreNotLookedUpButKept) {
  SceneDescription description;
  description.materials = {kGrey, lambert(Rgb(0), Rgb(9))};
  add_mesh(description, wall());
  add_mesh(description, speck(0.01f * kPixel, 1));
  description.environment.emplace().radiance = Rgb(1, 1, 1);
  const auto scene = build(description);
  Film left = film_before(scene, before_wall());
  for (int half = 0; half < kHalves; ++half) trace(scene, before_wall(), half, 64, left);
  ASSERT_EQ(mixed_of(left), kOne);
  HistorySource source(kWidth, kHeight);
  source.gather(left, left.bounds(), left.bounds());

  const auto seen_from = [&](const CameraPose& pose, const HistorySource& from, const CameraPose& from_pose) {
    Film film(kWidth, kHeight, {.history = true});
    Reprojection work(scene, film, film.bounds(), pose, {}, {{from_pose, &from, 0, false}});
    ReprojectionStats stats;
    work.carry(film.bounds(), stats);
    work.find_borders(film.bounds(), stats);
    work.settle(film.bounds(), stats);
    return film;
  };
  const Film aside = seen_from(before_wall(0.5), source, before_wall());
  for (int x = 2; x < kWidth - 2; ++x) {
    // Half a pixel to the right: two pixels show half of it each.
    const bool refused = x == kX || x == kX - 1;
    EXPECT_EQ(aside.history()->carried(x, kY).count[0] == 0, refused) << x;
    if (!refused) EXPECT_TRUE(aside.history()->carried(x, kY).looked_up()) << x;
    EXPECT_FALSE(aside.history()->carried(x, kY).mixed()) << x;
  }
  Film back = seen_from(before_wall(), source, before_wall());
  EXPECT_EQ(mixed_of(back), kOne);
  EXPECT_EQ(back.history()->carried(kX, kY).count[0], 64u);
  EXPECT_FALSE(back.history()->carried(kX, kY).looked_up());
  EXPECT_NEAR(back.half(0, kX, kY).sum[0], left.half(0, kX, kY).sum[0], 1e-4);  // means are floats

  // What came from between pixels stays such where it is kept.
  HistorySource copy(kWidth, kHeight);
  copy.gather(aside, aside.bounds(), aside.bounds());
  const Film again = seen_from(before_wall(0.5), copy, before_wall(0.5));
  EXPECT_TRUE(again.history()->carried(kX + 4, kY).looked_up());
}

}  // namespace
}  // namespace helio::test
