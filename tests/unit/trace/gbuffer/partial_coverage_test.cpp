// What samples find out about their pixels, and what becomes of history where they do.
#include "renderer/trace/gbuffer/partial_coverage.h"

#include <gtest/gtest.h>

#include <utility>

#include "renderer/film/history/film_history.h"
#include "renderer/trace/reuse/reprojection.h"
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

// A lamp that is a speck, just before a wall.
SceneDescription lamp_before(const Material& of_wall) {
  SceneDescription scene;
  scene.materials = {of_wall, lambert(Rgb(0), Rgb(9))};
  add_mesh(scene, wall());
  add_mesh(scene, speck(0.01f * kPixel, 1));
  return scene;
}

// A film that knows what its centres meet.
Film film_before(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose,
                 const PixelFilter& filter = {}) {
  Film film(kWidth, kHeight, {.history = true});
  Reprojection centres(scene, film, film.bounds(), pose, filter, {});
  ReprojectionStats stats;
  centres.carry(film.bounds(), stats);
  centres.find_borders(film.bounds(), stats);
  centres.settle(film.bounds(), stats);
  return film;
}

struct TraceOptions {
  PixelFilter filter = {};
  std::uint64_t seed = 1;
  CancelToken cancel = {};
};

// Samples [0, samples) of a half.
TraceStats trace(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, int half,
                 std::uint32_t samples, Film& film, const TraceOptions& options = {}) {
  const Camera camera(pose, kWidth, kHeight, scene->origin(), options.filter);
  PathSettings settings;
  settings.seed = options.seed;
  TraceStats stats;
  trace_window(*scene, camera, settings, {half, 0, samples}, film.bounds(), options.cancel, film, stats);
  return stats;
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

TEST(PartialCoverage, AreFoundByWhatIsSmallerThanAPixel) {
  SceneDescription leaf, ridge, nothing;
  for (SceneDescription* scene : {&leaf, &ridge, &nothing}) scene->materials = {kGrey};
  // Of one object: a step of two pixels, and a ridge less than half a pixel high.
  Object leaves, ridges;
  leaves.meshes = {wall(), speck(2 * kPixel, 0)};
  add_instance(leaf, add_object(leaf, std::move(leaves)));
  const V3f foot = point_of(0.1f, 0.4f), along(0.3f * kPixel, 0, 0);
  ridges.meshes = {wall(), quad(foot, along, {0, 0.15f * kPixel, 0.3f * kPixel}, 0)};
  add_instance(ridge, add_object(ridge, std::move(ridges)));
  // A speck, and nothing around it.
  add_mesh(nothing, speck(0, 0));
  for (const SceneDescription& description : {lamp_before(kGrey), leaf, ridge, nothing}) {
    const auto scene = build(description);
    for (int half = 0; half < kHalves; ++half) {
      Film film = film_before(scene, before_wall());
      EXPECT_FALSE(film.history()->centre(kX, kY).border);
      trace(scene, before_wall(), half, 64, film);
      EXPECT_EQ(mixed_of(film), kOne);
    }
  }
}

TEST(PartialCoverage, AreNoneOfOneSurface) {
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
  PixelFilter wide;
  wide.kind = PixelFilterKind::gaussian;
  wide.scale = 1.5;
  const CameraPose near = camera_at({0.1, 0.05, 1.3}, {0, 0, 0}, 40);
  for (const SceneDescription& description : {ball, slope, chip, pane}) {
    const auto scene = build(description);
    for (const CameraPose& pose : {before_wall(), near}) {
      for (const PixelFilter& filter : {PixelFilter(), wide}) {
        Film film = film_before(scene, pose, filter);
        trace(scene, pose, 0, 32, film, {.filter = filter});
        EXPECT_EQ(mixed_of(film), std::vector<int>());
      }
    }
  }
}

TEST(PartialCoverage, AreNotToldWhereCentresAreNotKnown) {
  const auto scene = build(lamp_before(kGrey));
  Film film = film_before(scene, before_wall());
  film.clear();
  EXPECT_FALSE(film.history()->centre(kX, kY).known());
  trace(scene, before_wall(), 0, 64, film);
  EXPECT_EQ(mixed_of(film), std::vector<int>());

  Film cancelled = film_before(scene, before_wall());
  TraceOptions options;
  options.cancel.cancel();
  trace(scene, before_wall(), 0, 64, cancelled, options);
  EXPECT_EQ(mixed_of(cancelled), std::vector<int>());
}

// A lamp that is smaller than a pixel is not smeared over those that look its pixel up, and comes back where that is
// kept as it was.
TEST(PartialCoverage, AreNotLookedUpButKept) {
  SceneDescription description = lamp_before(kGrey);
  description.environment.emplace().radiance = Rgb(1, 1, 1);
  const auto scene = build(description);
  Film left = film_before(scene, before_wall());
  for (int half = 0; half < kHalves; ++half) trace(scene, before_wall(), half, 64, left);
  ASSERT_EQ(mixed_of(left), kOne);
  left.history()->carried(3, 3).note_mixed();
  left.history()->centre(3, 3).border = 1;  // passed by whatever else it is
  HistorySource source(kWidth, kHeight);
  source.gather(left, left.bounds(), left.bounds());

  EXPECT_FALSE(source.pixel(3, 3).mixed());
  EXPECT_TRUE(source.pixel(kX, kY).mixed());
  EXPECT_LT(source.pixel(kX, kY).bend2(0), 0.1f) << "the lamp is no structure of the wall";

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
    EXPECT_EQ(aside.history()->carried(x, kY).looked_up(), !refused) << x;
    EXPECT_FALSE(aside.history()->carried(x, kY).mixed()) << x;
  }
  Film back = seen_from(before_wall(), source, before_wall());
  EXPECT_TRUE(back.history()->carried(kX, kY).mixed());
  EXPECT_EQ(back.history()->carried(kX, kY).count[0], 64u);
  EXPECT_FALSE(back.history()->carried(kX, kY).looked_up());
  EXPECT_NEAR(back.half(0, kX, kY).sum[0], left.half(0, kX, kY).sum[0], 0.2);  // means are rounded

  // What came from between pixels stays such where it is kept.
  HistorySource copy(kWidth, kHeight);
  copy.gather(aside, aside.bounds(), aside.bounds());
  const Film again = seen_from(before_wall(0.5), copy, before_wall(0.5));
  EXPECT_TRUE(again.history()->carried(kX + 4, kY).looked_up());
}

// What every pixel has looked up, 8 samples of 0.25 that scatter by 0.01, as of the wall.
void look_up(Film& film) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      CarriedPixel& carried = film.history()->carried(x, y);
      carried.note_looked_up();
      carried.means = PackedMeans(Rgb(0.25f), Rgb(0.25f));
      for (int h = 0; h < kHalves; ++h) {
        HalfPixel& half = film.half(h, x, y);
        carried.count[h] = half.count = 8;
        for (int c = 0; c < 3; ++c) {
          half.sum[c] = 2;
          half.deviations[c] = 0.07f;
        }
      }
    }
  }
}

// Halves drop what was looked up with their first sample that differs, wherever samples are cut, and are what they
// would be without.
TEST(PartialCoverage, DropWhatWasLookedUp) {
  const auto scene = build(lamp_before(lambert(Rgb(0, 0, 0))));
  const CameraPose pose = before_wall();
  int found_first = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Film once = film_before(scene, pose);
    look_up(once);
    const TraceStats stats = trace(scene, pose, 0, 1, once, {.seed = seed});
    const bool differs = mixed_of(once) == kOne;
    EXPECT_EQ(stats.dropped, differs ? 16u : 0u);
    // Nothing stands against the first sample of all.
    EXPECT_EQ(once.half(0, kX, kY).count, differs ? 1u : 9u);
    EXPECT_EQ(once.half(1, kX, kY).count, differs ? 0u : 8u);
    EXPECT_EQ(once.history()->carried(kX + 1, kY).count[0], 8u);
    found_first += differs;

    Film film = film_before(scene, pose), fresh = film_before(scene, pose);
    look_up(film);
    trace(scene, pose, 0, 128, film, {.seed = seed});
    trace(scene, pose, 0, 128, fresh, {.seed = seed});
    ASSERT_EQ(mixed_of(film), kOne);
    const HalfPixel &half = film.half(0, kX, kY), &expected = fresh.half(0, kX, kY);
    EXPECT_EQ(half.count, 128u);
    EXPECT_DOUBLE_EQ(half.sum[1], expected.sum[1]);
    EXPECT_NEAR(half.deviations[1], expected.deviations[1], 0.01f * expected.deviations[1] + 1);
    EXPECT_EQ(film.history()->carried(kX, kY).count[1], differs ? 0u : 8u);
    trace(scene, pose, 1, 128, film, {.seed = seed});
    EXPECT_EQ(film.half(1, kX, kY).count, 128u) << "each finds out for itself";
  }
  EXPECT_GT(found_first, 0);
  EXPECT_LT(found_first, 12);  // of 9 %
}

}  // namespace
}  // namespace helio::test
