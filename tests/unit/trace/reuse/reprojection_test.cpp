// What reprojection carries, on films whose pixels are written by hand: nothing here is a matter of chance.
#include "renderer/trace/reuse/reprojection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera_projection.h"
#include "tests/support/directions.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 48, kHeight = 36;

ReprojectionStats look_through(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, Film& film,
                               std::vector<PictureSource> sources, const PixelRect& region) {
  Reprojection work(scene, film, region, pose, {}, std::move(sources));
  ReprojectionStats stats;
  work.carry(region, stats);
  work.find_borders(region, stats);
  work.settle(region, stats);
  return stats;
}

// The film of a camera that has drawn on `sources`.
Film film_of(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose,
             std::vector<PictureSource> sources = {}) {
  Film film(kWidth, kHeight, {.history = true});
  look_through(scene, pose, film, std::move(sources), film.bounds());
  return film;
}

struct HalfSamples {
  double mean = 0;
  std::uint32_t count = 0;
  float variance = 0;  // of one of them
};

// A picture that has been seen through a camera: samples(film, x, y, half) of each half of a pixel, all of them carried
// with a bound of sqrt(bias2). Its light came along `directions`.
template <class Samples>
HistorySource picture(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, float bias2,
                      const Samples& samples, const DirectionReservoir& directions = {}) {
  Film film = film_of(scene, pose);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      CarriedPixel& carried = film.history()->carried(x, y);
      carried.bias2 = bias2;
      film.history()->directions(x, y) = directions;
      for (int h = 0; h < kHalves; ++h) {
        const HalfSamples of = samples(film, x, y, h);
        HalfPixel& half = film.half(h, x, y);
        half.count = carried.count[h] = of.count;
        for (int c = 0; c < 3; ++c) {
          half.sum[c] = of.mean * of.count;
          half.deviations[c] = of.variance * float(of.count - 1);
        }
      }
    }
  }
  HistorySource source(kWidth, kHeight);
  source.gather(film, film.bounds(), film.bounds());
  return source;
}

CameraPose turned(CameraPose pose, double degrees) {
  const double a = degrees * 3.14159265358979 / 180, cosine = std::cos(a), sine = std::sin(a);
  const V3d right = pose.right, forward = pose.forward;
  pose.forward = forward * cosine - right * sine;
  pose.right = right * cosine + forward * sine;
  return pose;
}

// A wall before the camera, wider than it sees.
std::shared_ptr<const RenderScene> wall_of(const Material& material) {
  SceneDescription scene;
  scene.materials = {material};
  add_mesh(scene, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
  return build(scene);
}

const CameraPose kBeforeWall = camera_at({0, 0, 4}, {0, 0, 0});

// Pixels of 1 / 16 on the wall.
CameraPose orthographic_before_wall(double x = 0, double y = 0, double zoom = 1) {
  CameraPose pose = camera_at({x / 16, y / 16, 4}, {x / 16, y / 16, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 0.5 * kHeight / 16 / zoom;
  return pose;
}

// A floor, a box on it, and two parallel walls that are one object; above and beside them is nothing.
std::shared_ptr<const RenderScene> surfaces() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-3, -1, 2}, {6, 0, 0}, {0, 0, -6}, 0));
  add_mesh(scene, box({-0.5f, -1, 0.2f}, {0.1f, 0.4f, 0.8f}, 0));
  Object walls;
  walls.meshes = {quad({-1.6f, -0.9f, -1.5f}, {2.4f, 0, 0}, {0, 1.6f, 0}, 0),
                  quad({0.2f, -0.9f, -0.7f}, {1, 0, 0}, {0, 1.2f, 0}, 0)};
  add_instance(scene, add_object(scene, walls));
  return build(scene);
}

// A radiance for every plane of every instance, and one for what leaves the scene.
double radiance_of_surface(const CentreHit& centre, const V3d& position) {
  if (!centre.hit()) return 7;
  const V3d normal(unpack_direction(centre.normal));
  return 10 + 100 * centre.instance + 20 * normal.x + 7 * normal.y + 2 * dot(normal, position);
}

V3d position_of(const CameraProjection& camera, const CentreHit& centre, int x, int y) {
  return centre.hit() ? camera.position_at(x + 0.5, y + 0.5, double(centre.depth)) : V3d(0, 0, 0);
}

bool meets_another(const Film& film, int x, int y) {
  const CentreHit& here = film.history()->centre(x, y);
  for (int py = std::max(y - 1, 0); py <= std::min(y + 1, kHeight - 1); ++py) {
    for (int px = std::max(x - 1, 0); px <= std::min(x + 1, kWidth - 1); ++px) {
      const CentreHit& there = film.history()->centre(px, py);
      if (there.instance != here.instance) return true;
      if (here.hit() && dot(unpack_direction(there.normal), unpack_direction(here.normal)) < 0.5f) return true;
    }
  }
  return false;
}

TEST(Reprojection, EverySurfaceKeepsItsOwnRadianceAndBordersHaveNone) {
  const auto scene = surfaces();
  for (const double step : {0.3, -0.6}) {
    const CameraPose before = camera_at({0.3, 0.3, 4}, {0, -0.1, 0}, 45),
                     after = camera_at({0.3 + step, 0.4, 3.9}, {0.05, -0.1, 0}, 45);
    const CameraProjection old_view(before, kWidth, kHeight, scene->origin()),
        new_view(after, kWidth, kHeight, scene->origin());
    const HistorySource source = picture(scene, before, 0, [&](const Film& film, int x, int y, int) {
      const CentreHit& centre = film.history()->centre(x, y);
      return HalfSamples{centre.border ? 1e4 : radiance_of_surface(centre, position_of(old_view, centre, x, y)), 4, 1};
    });
    const Film film = film_of(scene, after, {{before, &source, 0, false}});
    int carried_pixels = 0, borders = 0, near_another = 0, new_sky = 0, new_surface = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const CentreHit& centre = film.history()->centre(x, y);
        const CarriedPixel& carried = film.history()->carried(x, y);
        const V3d position = position_of(new_view, centre, x, y);
        // Its centre's, as long as there is no fresh sample.
        EXPECT_EQ(film.features(x, y).count, carried.count[0] > 0 ? 1u : 0u);
        EXPECT_EQ(film.features(x, y).primitive != ~0u, carried.count[0] > 0 && centre.hit());
        near_another += meets_another(film, x, y);
        if (centre.border) {
          EXPECT_EQ(carried.count[0] + carried.count[1], 0u) << x << ", " << y;
          ++borders;
        } else if (carried.count[0] == 0) {
          ++(centre.hit() ? new_surface : new_sky);
        } else {
          const double radiance = radiance_of_surface(centre, position);
          for (int h = 0; h < kHalves; ++h) EXPECT_NEAR(carried.means.mean(h)[1], radiance, 0.02) << x << ", " << y;
          ++carried_pixels;
        }
      }
    }
    EXPECT_GT(carried_pixels, kWidth * kHeight / 2);
    EXPECT_GT(borders, 60);
    EXPECT_GT(near_another, 1.2 * borders);
    EXPECT_GT(new_sky, 10);
    EXPECT_GT(new_surface, 2);
  }
}

// Before the wall a plate, or none, that covers the left 0.4 of the first column of pixels, and what is beside the
// picture.
std::shared_ptr<const RenderScene> wall_with_plate(bool with_plate) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
  if (with_plate) {
    const double left = -kWidth / 2 / 16.0;
    Object plate;
    plate.meshes = {quad(V3f(V3d(left - 2, -20, 1)), V3f(V3d(2 + 0.4 / 16, 0, 0)), {0, 40, 0}, 0)};
    add_instance(scene, add_object(scene, std::move(plate)));
  }
  return build(scene);
}

TEST(Reprojection, SurfacesBesideThePictureHaveBordersInIt) {
  const auto scene = wall_with_plate(true);
  const CameraPose before = orthographic_before_wall();
  const HistorySource source = picture(scene, before, 0, [](const Film& film, int x, int, int) {
    EXPECT_EQ(film.history()->centre(x, 3).border, x == 0) << x;
    return HalfSamples{x == 0 ? 1e4 : 1.0, 16, 0.25f};
  });
  // Of pixels half as large, one between the plate and the middle of what was the first pixel shows neither.
  const CameraPose after = orthographic_before_wall(-19.8, 0, 2);
  const Film film = film_of(scene, after, {{before, &source, 0, false}});
  for (const int x : {15, 16, 17}) EXPECT_EQ(film.history()->centre(x, 9).border, x == 16 ? 1u : 0u) << x;
  int carried_pixels = 0;
  for (int x = 0; x < kWidth; ++x) {
    const CarriedPixel& carried = film.history()->carried(x, 9);
    if (carried.count[0] == 0) continue;
    EXPECT_FLOAT_EQ(carried.means.mean(0)[1], 1) << x;
    ++carried_pixels;
  }
  EXPECT_EQ(carried_pixels, kWidth - 17);
}

// The same wall behind a plate whose right side lies 0.8 into the column 10: pixels of the next one show it alone.
TEST(Reprojection, PixelsNextToAnEdgeAreOfUseUnlessSomethingShines) {
  for (const bool shines : {false, true}) {
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0.5f, 0.5f, 0.5f))};
    if (shines) scene.materials[1].emission = Rgb(10, 10, 10);
    add_mesh(scene, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
    const double edge = (10.8 - kWidth / 2.0) / 16;
    Object plate;
    plate.meshes = {quad({-20, -20, 1}, V3f(V3d(20 + edge, 0, 0)), {0, 40, 0}, 1)};
    add_instance(scene, add_object(scene, std::move(plate)));
    const auto built = build(scene);
    const Film film = film_of(built, orthographic_before_wall());
    for (const int x : {9, 10, 11, 12})
      EXPECT_EQ(film.history()->centre(x, 9).border, x == 10 || (shines && x == 11) ? 1u : 0u) << x << shines;
    EXPECT_EQ(film.history()->centre(9, 9).shines, shines ? 1u : 0u);
    // What a filter brings from beyond the pixel no rim tells.
    Film filtered(kWidth, kHeight, {.history = true});
    Reprojection work(built, filtered, filtered.bounds(), orthographic_before_wall(), {PixelFilterKind::tent, 1.0}, {});
    ReprojectionStats stats;
    work.carry(filtered.bounds(), stats);
    work.find_borders(filtered.bounds(), stats);
    work.settle(filtered.bounds(), stats);
    for (const int x : {9, 10, 11, 12})
      EXPECT_EQ(filtered.history()->centre(x, 9).border, x == 10 || x == 11 ? 1u : 0u) << x;
  }
}

// Leaves of one crown: two plates of one object, the nearer one over the left half of the picture.
TEST(Reprojection, StepsOfOneObjectAreBorders) {
  for (const float step : {0.02f, 1.0f}) {  // pixels are 1 / 16
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
    Object plates;
    plates.meshes = {quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0),
                     quad({-20, -20, step}, {20 + 0.4f / 16, 0, 0}, {0, 40, 0}, 0)};
    add_instance(scene, add_object(scene, std::move(plates)));
    const Film film = film_of(build(scene), orthographic_before_wall());
    for (int x = 0; x < kWidth; ++x)
      EXPECT_EQ(film.history()->centre(x, 10).border, step > 0.1f && x == kWidth / 2) << step << " at " << x;
  }
}

// What bends by as much as a surface may from one pixel to the next is no step, seen from the side either.
TEST(Reprojection, RoundSurfacesHaveNoSteps) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  Object ball;
  ball.spheres.push_back({V3f(0, 0, 0), 1.0f, 0});
  add_instance(scene, add_object(scene, std::move(ball)));
  const Film film = film_of(build(scene), orthographic_before_wall());
  for (int x = kWidth / 2 - 13; x < kWidth / 2 + 13; ++x)
    EXPECT_FALSE(film.history()->centre(x, kHeight / 2).border) << x;
}

// Of one object, with one normal: only the distance between the planes tells the plate from the wall that it hid.
TEST(Reprojection, WhatAPlateHidIsNotTakenFromIt) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  Object plates;
  plates.meshes = {quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0), quad({-20, -20, 1}, {20, 0, 0}, {0, 40, 0}, 0)};
  add_instance(scene, add_object(scene, std::move(plates)));
  const auto built = build(scene);
  const CameraPose before = camera_at({-1, 0, 4}, {0, 0, 0.5}), after = camera_at({1, 0, 4}, {0, 0, 0.5});
  const auto on_plate = [&](const CameraPose& pose, const CentreHit& centre, int x, int y) {
    return position_of(CameraProjection(pose, kWidth, kHeight, built->origin()), centre, x, y).z + built->origin().z >
           0.5;
  };
  const HistorySource source = picture(built, before, 0, [&](const Film& film, int x, int y, int) {
    return HalfSamples{on_plate(before, film.history()->centre(x, y), x, y) ? 100.0 : 1.0, 16, 1};
  });
  Film film(kWidth, kHeight, {.history = true});
  look_through(built, after, film, {{before, &source, 0, false}}, film.bounds());
  int of_plate = 0, of_wall = 0, hidden = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const CarriedPixel& carried = film.history()->carried(x, y);
      const bool plate = on_plate(after, film.history()->centre(x, y), x, y);
      if (carried.count[0] == 0) {
        hidden += !plate;
        continue;
      }
      EXPECT_NEAR(carried.means.mean(0)[1], plate ? 100 : 1, plate ? 0.5 : 0.01) << x << ", " << y;
      ++(plate ? of_plate : of_wall);
    }
  }
  EXPECT_GT(of_plate, 50);
  EXPECT_GT(of_wall, 50);
  EXPECT_GT(hidden, 50);
}

TEST(Reprojection, AGlanceFindsNarrowStrips) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const CameraPose before = orthographic_before_wall();
  const HistorySource source = picture(scene, before, 0, [](const Film&, int, int, int) {
    return HalfSamples{1, 16, 0.25f};
  });
  const auto glance = [&](const CameraPose& pose, ReprojectionStats& stats) {
    Film film(kWidth, kHeight, {.history = true});
    const Reprojection work(scene, film, film.bounds(), pose, {}, {{before, &source, 0, false}});
    const Reprojection::Glance told = work.glance(film.bounds(), stats);
    return double(told.known) / double(told.asked);
  };
  // Of the same camera, but left before it had a sample.
  const HistorySource nothing = picture(scene, before, 0, [](const Film&, int, int, int) { return HalfSamples{}; });
  Film film(kWidth, kHeight, {.history = true});
  ReprojectionStats none, some;
  EXPECT_EQ(Reprojection(scene, film, film.bounds(), before, {}, {{before, &nothing, 0, false}})
                .glance(film.bounds(), none)
                .known,
            0u);
  EXPECT_EQ(glance(before, none), 1);
  EXPECT_EQ(none.rays, 0u) << "the same camera";
  for (const int shift : {1, 24, kWidth - 2, 2 - kWidth}) {
    ReprojectionStats stats;
    EXPECT_NEAR(glance(orthographic_before_wall(shift, 0), stats), 1 - std::abs(shift) / double(kWidth), 0.06) << shift;
    EXPECT_GT(glance(orthographic_before_wall(shift, 0), stats), 0) << shift;
    EXPECT_EQ(stats.rays, std::uint64_t(2 * kWidth * kHeight / 16));
  }
  EXPECT_EQ(glance(orthographic_before_wall(kWidth + 2, 0), some), 0);
  EXPECT_EQ(some.rays, std::uint64_t(kWidth * kHeight / 16)) << "one of 4x4 pixels of so small a film";
}

TEST(Reprojection, ClearingForgetsThePictureBefore) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const HistorySource source = picture(scene, orthographic_before_wall(), 0, [](const Film&, int, int, int) {
    return HalfSamples{1, 16, 0.25f};
  });
  Film film = film_of(scene, orthographic_before_wall(5), {{orthographic_before_wall(), &source, 0, false}});
  ASSERT_GT(film.half(0, 20, 20).count, 0u);
  film.history()->directions(20, 20).set_direction(0, 0, 77);
  Reprojection work(scene, film, film.bounds(), orthographic_before_wall(999), {}, {});
  work.clear({0, 0, kWidth, kHeight - 1});
  EXPECT_EQ(film.half(0, 20, 20).count, 0u);
  EXPECT_EQ(film.history()->carried(20, 20).count[0], 0u);
  EXPECT_EQ(film.history()->directions(20, 20).direction(0, 0), DirectionReservoir::kNone);
  EXPECT_EQ(film.features(20, 20).count, 0u);
  EXPECT_GT(film.half(0, 20, kHeight - 1).count, 0u) << "outside the window";
}

// A camera at rest: of what was on a border at the picture's edge nobody knows whether what was beside it still is.
TEST(Reprojection, EdgesOfPicturesFromBeforeAnEditDoNotComeBack) {
  const auto bare = wall_with_plate(false), covered = wall_with_plate(true);
  const CameraPose pose = orthographic_before_wall();
  for (const auto& [before, after] : {std::pair(bare, covered), std::pair(covered, bare)}) {
    const HistorySource source = picture(before, pose, 0, [](const Film&, int, int, int) {
      return HalfSamples{1, 16, 0.25f};
    });
    for (const bool edited : {false, true}) {
      PictureSource of{pose, &source, 0, false};
      of.edited = edited;
      const Film film = film_of(after, pose, {of});
      EXPECT_EQ(film.history()->carried(0, 9).count[0], edited ? 0u : 16u);
      EXPECT_EQ(film.history()->carried(1, 9).count[0], 16u);
      EXPECT_EQ(film.history()->carried(kWidth - 1, 9).count[0], 16u);
    }
  }
}

TEST(Reprojection, LooksUpBetweenPixels) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const auto ramp = [](double x, double y) { return 3 + 0.1 * x + 0.04 * y; };
  const CameraPose before = orthographic_before_wall();
  const HistorySource source = picture(scene, before, 0, [&](const Film&, int x, int y, int) {
    return HalfSamples{ramp(x, y), 16, 0.25f};
  });
  const Film film = film_of(scene, orthographic_before_wall(2.3, -1.6), {{before, &source, 0, false}});
  for (int y = 0; y < kHeight - 2; ++y) {
    for (int x = 0; x < kWidth - 3; ++x) {
      const CarriedPixel& carried = film.history()->carried(x, y);
      for (int h = 0; h < kHalves; ++h) {
        EXPECT_NEAR(carried.means.mean(h)[1], ramp(x + 2.3, y + 1.6), 1e-4);
        EXPECT_EQ(carried.count[h], 16u);  // a ramp is looked up without error
        EXPECT_NEAR(film.half(h, x, y).sum[1], 16 * ramp(x + 2.3, y + 1.6), 1e-2);
        EXPECT_NEAR(film.half(h, x, y).deviations[1], 0.25 * 15, 1e-3);
      }
    }
  }
}

TEST(Reprojection, RadianceIsLookedUpOverTheAlbedo) {
  // The picture's albedo is that of the surface, wherever it stands: twice the albedo is twice the radiance.
  const auto dark = wall_of(lambert(Rgb(0.25f, 0.25f, 0.25f))), bright = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const HistorySource source = picture(dark, kBeforeWall, 0, [](const Film&, int, int, int) {
    return HalfSamples{1, 16, 0.25f};
  });
  const Film film = film_of(bright, turned(kBeforeWall, 1), {{kBeforeWall, &source, 0, false}});
  EXPECT_NEAR(film.history()->carried(20, 20).means.mean(0)[1], 2, 0.01);  // ten bits of an albedo
  EXPECT_NEAR(film.half(0, 20, 20).deviations[1], 4 * 0.25 * 15, 0.15);
}

TEST(Reprojection, BiasAndTheVarianceOfTheOtherHalfCapWhatHistoryCounts) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const std::uint32_t count[kHalves] = {16, 64};
  const float variance[kHalves] = {0.5f, 2};
  for (const float bias2 : {0.0f, 0.05f, 3.0f}) {
    const HistorySource source = picture(scene, kBeforeWall, bias2, [&](const Film&, int, int, int h) {
      return HalfSamples{1, count[h], variance[h]};
    });
    const Film film = film_of(scene, turned(kBeforeWall, 2), {{kBeforeWall, &source, 0, false}});
    const CarriedPixel& carried = film.history()->carried(24, 17);
    EXPECT_NEAR(carried.bias2, bias2, 1e-5f);  // nothing bends, and the camera only turned
    for (int h = 0; h < kHalves; ++h) {
      // N = 1 / (1 / N_0 + b^2 / v), rounded to nearest.
      const double expected = 1 / (1.0 / count[h] + double(bias2) / double(variance[1 - h]));
      EXPECT_EQ(carried.count[h], std::uint32_t(expected + 0.5)) << bias2;
      EXPECT_EQ(film.attempted(h, 24, 17), 0u);
    }
  }
}

// A column with the mirror image of a lamp, which few samples find, beside pixels that hardly scatter: what lies
// between the two may be either. Held against the mean of both variances 4 for 0.05 would count more than a hundred
// samples.
TEST(Reprojection, LookupsBetweenNoiseAndQuietAreHeldAgainstTheQuiet) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const CameraPose before = orthographic_before_wall();
  constexpr int kSpike = 20;
  constexpr double kCount = 256;
  constexpr float kNoisy[kHalves] = {7000, 1750};
  for (const float quiet : {0.01f, 1000.0f}) {
    const HistorySource source = picture(scene, before, 0, [&](const Film&, int x, int, int h) {
      return HalfSamples{x == kSpike ? 8 : 0.05, std::uint32_t(kCount), x == kSpike ? kNoisy[h] : quiet};
    });
    const Film film = film_of(scene, orthographic_before_wall(0.5, 0), {{before, &source, 0, false}});
    for (const int x : {kSpike - 1, kSpike}) {
      const CarriedPixel& carried = film.history()->carried(x, 10);
      EXPECT_NEAR(carried.means.mean(0)[1], 8.05 / 2, 0.01);
      EXPECT_GT(carried.bias2, 0.1f);
      for (int h = 0; h < kHalves; ++h) {
        const double variance = std::sqrt(double(kNoisy[1 - h]) * double(quiet));  // the other half's
        const double n = 1 / (1 / kCount + double(carried.bias2) / variance);
        EXPECT_NEAR(carried.count[h], n, 0.02 * n + 0.5) << quiet;
        EXPECT_EQ(carried.count[h] < kCount / 10, quiet < 1);
      }
    }
    EXPECT_EQ(film.history()->carried(kSpike + 6, 10).count[0], kCount) << "nothing bends";
  }
}

TEST(Reprojection, BoundsAddUpFromMoveToMove) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const CameraPose before = orthographic_before_wall();
  constexpr float kBias2 = 0.04f;
  std::vector<Film> films;
  for (const float bias2 : {0.0f, kBias2}) {
    const HistorySource source = picture(scene, before, bias2, [](const Film&, int x, int, int) {
      return HalfSamples{2 + std::sin(0.7 * x), 4096, 1};
    });
    films.push_back(film_of(scene, orthographic_before_wall(0.5, 0), {{before, &source, 0, false}}));
  }
  for (int x = 4; x < kWidth - 4; ++x) {
    const float without = films[0].history()->carried(x, 10).bias2, with = films[1].history()->carried(x, 10).bias2;
    EXPECT_GT(without, 1e-4f);
    EXPECT_NEAR(std::sqrt(with), std::sqrt(without) + std::sqrt(kBias2), 1e-3f);
  }
}

TEST(Reprojection, HalvesSwapTheirLineage) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const HistorySource source = picture(scene, kBeforeWall, 0, [](const Film&, int, int, int h) {
    return h == 0 ? HalfSamples{1, 4, 0.5f} : HalfSamples{3, 9, 0.25f};
  });
  for (const bool swap : {false, true}) {
    const Film film = film_of(scene, turned(kBeforeWall, 1), {{kBeforeWall, &source, 0, swap}});
    const CarriedPixel& carried = film.history()->carried(20, 20);
    const int first = swap ? 1 : 0, second = 1 - first;
    EXPECT_FLOAT_EQ(carried.means.mean(first)[0], 1);
    EXPECT_FLOAT_EQ(carried.means.mean(second)[0], 3);
    EXPECT_EQ(carried.count[first], 4u);
    EXPECT_EQ(carried.count[second], 9u);
    EXPECT_NEAR(film.half(first, 20, 20).deviations[0], 0.5 * 3, 0.02);
  }
}

TEST(Reprojection, ASourceThatKnowsEnoughIsNotBettered) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const auto plain = [&](double mean, std::uint32_t count) {
    return picture(scene, kBeforeWall, 0, [=](const Film&, int, int, int) { return HalfSamples{mean, count, 1}; });
  };
  const HistorySource few = plain(1, 4), many = plain(2, 16);
  for (const auto& [enough, expected] : {std::pair(8.0f, 1.0f), std::pair(9.0f, 2.0f)}) {
    const Film film =
        film_of(scene, turned(kBeforeWall, 1), {{kBeforeWall, &few, enough, false}, {kBeforeWall, &many, 0, false}});
    EXPECT_FLOAT_EQ(film.history()->carried(20, 20).means.mean(0)[0], expected);
    const Film reverse =
        film_of(scene, turned(kBeforeWall, 1), {{kBeforeWall, &many, 99, false}, {kBeforeWall, &few, 0, false}});
    EXPECT_FLOAT_EQ(reverse.history()->carried(20, 20).means.mean(0)[0], 2);
  }
}

// Of glossy surfaces it shows only after the change of view who knows more.
TEST(Reprojection, ASourceThatTheViewHasChangedIsBettered) {
  Material metal;
  metal.metallic = 1;
  metal.base_color = Rgb(1, 1, 1);
  metal.roughness = 0.4f;
  const auto scene = wall_of(metal);
  const std::uint32_t ahead = packed(V3f(0, 0, 1));
  const auto plain = [&](double mean, std::uint32_t count, const CameraPose& pose) {
    return picture(
        scene, pose, 0,
        [&](const Film&, int, int, int) {
          return HalfSamples{mean, count, 1};
        },
        in_each_half(ahead, ahead));
  };
  CameraPose far = kBeforeWall, near = kBeforeWall;
  far.position.x += 1.5;
  near.position.x += 0.001;
  const HistorySource anchor = plain(1, 1 << 16, far), newest = plain(2, 64, near);
  const Film film = film_of(scene, kBeforeWall, {{far, &anchor, 1 << 16, false}, {near, &newest, 0, false}});
  EXPECT_NEAR(film.history()->carried(kWidth / 2, kHeight / 2).means.mean(0)[0], 2, 0.05);
}

TEST(Reprojection, CountsHaveALimit) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const HistorySource source = picture(scene, kBeforeWall, 0, [](const Film&, int, int, int) {
    return HalfSamples{1, CarriedPixel::kMostCount, 1};
  });
  const Film film = film_of(scene, turned(kBeforeWall, 2), {{kBeforeWall, &source, 0, false}});
  for (int h = 0; h < kHalves; ++h) {
    EXPECT_GT(film.history()->carried(20, 20).count[h], CarriedPixel::kMostCount / 2);
    EXPECT_EQ(film.attempted(h, 20, 20), 0u);
  }
}

// Neighbours have a say, but those of a block alone: the same bits however the picture is cut along these.
TEST(Reprojection, GlossySurfacesAreTheSameHoweverTheyAreCut) {
  Material metal;
  metal.metallic = 1;
  metal.base_color = Rgb(1, 0.8f, 0.5f);
  metal.roughness = 0.5f;
  const auto scene = wall_of(metal);
  const HistorySource source = picture(
      scene, kBeforeWall, 0,
      [](const Film&, int x, int y, int h) {
        return HalfSamples{1 + 0.1 * ((x * 7 + y * 5 + h) % 11), 1 << 20, 100};
      },
      in_each_half(packed(V3f(0, 0, 1)), packed(V3f(0, 0.6f, 0.8f))));
  CameraPose aside = kBeforeWall;
  aside.position.x += 0.4;
  Film whole(kWidth, kHeight, {.history = true}), cut(kWidth, kHeight, {.history = true});
  ReprojectionStats stats;
  Reprojection(scene, whole, whole.bounds(), aside, {}, {{kBeforeWall, &source, 0, false}})
      .carry(whole.bounds(), stats);
  Reprojection pieces(scene, cut, cut.bounds(), aside, {}, {{kBeforeWall, &source, 0, false}});
  std::vector<PixelRect> blocks = cut_aligned(cut.bounds(), kFilmBlock, kFilmBlock);
  std::reverse(blocks.begin(), blocks.end());
  for (const PixelRect& block : blocks) pieces.carry(block, stats);
  int carried = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const CarriedPixel &a = whole.history()->carried(x, y), &b = cut.history()->carried(x, y);
      carried += a.count[0] > 0;
      EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0) << x << ", " << y;
      EXPECT_TRUE(whole.history()->directions(x, y) == cut.history()->directions(x, y)) << x << ", " << y;
    }
  }
  EXPECT_GT(carried, kWidth * kHeight / 2);
}

// Of two directions that brought as much to the earlier camera, each pixel remembers more of the one that the lobe has
// turned to; as many of each where the camera stays where it is.
TEST(Reprojection, DirectionsAreRememberedByWhatTheyBringToTheNewCamera) {
  Material metal;
  metal.metallic = 1;
  metal.base_color = Rgb(1, 1, 1);
  metal.roughness = 0.6f;
  const auto scene = wall_of(metal);
  const std::uint32_t left = packed(V3f(-0.3f, 0, 1) * (1 / std::sqrt(1.09f)));
  const std::uint32_t right = packed(V3f(0.3f, 0, 1) * (1 / std::sqrt(1.09f)));
  const auto plain = [](const Film&, int, int, int) { return HalfSamples{1, 64, 1}; };
  const HistorySource source = picture(scene, kBeforeWall, 0, plain, in_each_half(left, right));
  const auto share_of_left = [&](const CameraPose& pose) {
    const Film film = film_of(scene, pose, {{kBeforeWall, &source, 0, false}});
    int count[2] = {0, 0};
    for (int y = 10; y < kHeight - 10; ++y) {
      for (int x = kWidth / 2 - 4; x < kWidth / 2 + 4; ++x) {
        for (const std::uint32_t packed : directions_in(film.history()->directions(x, y))) {
          EXPECT_TRUE(packed == left || packed == right) << packed;
          ++count[packed == right];
        }
      }
    }
    return double(count[0]) / (count[0] + count[1]);
  };
  CameraPose to_the_right = kBeforeWall;  // from where the wall shows what lies to the left
  to_the_right.position.x += 0.8;
  EXPECT_GT(share_of_left(to_the_right), 0.55);
  EXPECT_LT(share_of_left(to_the_right), 0.95);
  EXPECT_NEAR(share_of_left(turned(kBeforeWall, 1)), 0.5, 0.02);
}

TEST(Reprojection, OnlyTheRegionIsDrawnOn) {
  // Sources may hold another, older picture outside the region.
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const PixelRect region = {10, 8, 30, 28};
  HistorySource source = picture(scene, kBeforeWall, 0, [](const Film&, int, int, int) {
    return HalfSamples{1e4, 16, 1};
  });
  Film film(kWidth, kHeight, {.history = true});
  look_through(scene, kBeforeWall, film, {}, region);
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      for (int h = 0; h < kHalves; ++h) film.half(h, x, y).add(Rgb(1, 1, 1));
    }
  }
  source.gather(film, region, region);
  const ReprojectionStats stats =
      look_through(scene, turned(kBeforeWall, 8), film, {{kBeforeWall, &source, 0, false}}, region);
  EXPECT_GT(stats.carried, 100u);
  EXPECT_LT(stats.carried, std::uint64_t(region.area()));
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      const CarriedPixel& carried = film.history()->carried(x, y);
      if (carried.count[0] == 0) continue;
      EXPECT_FLOAT_EQ(carried.means.mean(0)[1], 1) << x << ", " << y;
    }
  }
}

// What a camera that steps aside, or turns, expects to be wrong of a surface of radiance 1, at the film's middle; none
// where it does not draw on what was there.
std::optional<float> bias2_after(const Material& material, const CameraPose& pose) {
  const auto scene = wall_of(material);
  const HistorySource source = picture(scene, kBeforeWall, 0, [](const Film&, int, int, int) {
    return HalfSamples{1, 1 << 20, 1};
  });
  const Film film = film_of(scene, pose, {{kBeforeWall, &source, 0, false}});
  const CarriedPixel& carried = film.history()->carried(24, 18);
  return carried.count[0] > 0 ? std::optional(carried.bias2) : std::nullopt;
}

TEST(Reprojection, WhatDependsOnTheViewIsLessCertainFromElsewhere) {
  CameraPose aside = kBeforeWall;
  aside.position.x += 0.1;
  Material metal;
  metal.metallic = 1;
  metal.base_color = Rgb(1, 1, 1);
  metal.roughness = 0;
  EXPECT_EQ(bias2_after(metal, turned(kBeforeWall, 3)), 0);
  EXPECT_FALSE(bias2_after(metal, aside));  // a mirror shows another thing altogether
  float last = 2;
  for (const float roughness : {0.2f, 0.5f, 1.0f}) {
    metal.roughness = roughness;
    EXPECT_EQ(bias2_after(metal, turned(kBeforeWall, 3)), 0);
    const float bias2 = bias2_after(metal, aside).value_or(-1);
    std::printf("roughness %g: %g\n", double(roughness), double(bias2));
    EXPECT_LT(bias2, 0.8f * last) << roughness;
    EXPECT_GT(bias2, 0) << roughness;
    last = bias2;
  }
  EXPECT_EQ(bias2_after(lambert(Rgb(0.5f, 0.5f, 0.5f)), aside), 0);
}

// A shiny coat on a matte wall, in a room of radiance 1. Of the light a quarter had come by way of the coat, from where
// it shows no more; what it shows instead no direction tells, and is taken to be as bright as the picture.
TEST(Reprojection, LightThatComesIntoViewIsNotMissing) {
  Material coated;
  coated.base_color = Rgb(1, 1, 1);
  coated.metallic = 0.25f;
  coated.roughness = 0.2f;
  const auto scene = wall_of(coated);
  const std::uint32_t beside = packed(V3f(0, 0.8f, 0.6f));
  DirectionReservoir directions = in_each_half(beside, beside, 0.25f);
  directions.set_direction(0, 0, packed(V3f(0, 0, 1)));  // mirrored to the film's middle
  const HistorySource source = picture(
      scene, kBeforeWall, 0,
      [](const Film&, int, int, int) {
        return HalfSamples{1, 1 << 20, 100};
      },
      directions);
  const CameraPose aside = camera_at({4, 0, 2}, {0, 0, 0});
  const Film film = film_of(scene, aside, {{kBeforeWall, &source, 0, false}});
  const CarriedPixel& carried = film.history()->carried(kWidth / 2, kHeight / 2);
  ASSERT_GT(carried.count[0], 0u);
  EXPECT_NEAR(carried.means.mean(0).y, 1, 0.15);
  EXPECT_GT(carried.bias2, sqr(0.5f * 0.25f)) << "it is a guess";
}

// Share of the interval [from, from + size) to the right of `edge`.
double covered(double from, double size, double edge) {
  return std::clamp((from + size - edge) / size, 0.0, 1.0);
}

// The same of a square, `along` and `across` an edge that leans by an eighth.
double square_covered(double along, double across, double size, double edge) {
  constexpr int kRows = 8;
  double sum = 0;
  for (int i = 0; i < kRows; ++i) sum += covered(along, size, edge + (across + (i + 0.5) * size / kRows) / 8) / kRows;
  return sum;
}

// Pictures of an edge that meets pixels everywhere, pixels being means over their squares, looked up by cameras that
// stand elsewhere or see with larger or smaller pixels: the sum of the squares that are expected of the lookups is that
// of those found, but for how far 3x3 means and their caution know where the edge is (HistorySource tests). Where
// pixels grow it is an upper bound: the mean of two pixels is exactly what one of twice the size sees between them.
TEST(Reprojection, ExpectsTheErrorThatLookingUpAnEdgeHas) {
  const auto scene = wall_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  const CameraPose before = orthographic_before_wall();
  for (const bool upright : {true, false}) {
    const double middle = 0.5 * (upright ? kWidth : kHeight), middle_across = 0.5 * (upright ? kHeight : kWidth);
    const double edge = middle - middle_across / 8;
    const HistorySource source = picture(scene, before, 0, [&](const Film&, int x, int y, int) {
      return HalfSamples{1 + square_covered(upright ? x : y, upright ? y : x, 1, edge), 1 << 20, 1};
    });
    for (const double zoom : {0.5, 0.8, 1.0, 1.5, 2.0, 4.0}) {  // new pixels along the side of an old one
      double expected = 0, found = 0;
      constexpr int kShifts = 16;
      for (int k = 0; k < kShifts; ++k) {
        const double shift = (k + 0.5) / kShifts;
        const Film film = film_of(scene, orthographic_before_wall(upright ? shift : 0, upright ? 0 : -shift, zoom),
                                  {{before, &source, 0, false}});
        for (int y = 4; y < kHeight - 4; ++y) {
          for (int x = 4; x < kWidth - 4; ++x) {
            const CarriedPixel& carried = film.history()->carried(x, y);
            if (carried.count[0] == 0) continue;
            const double along = middle + shift + ((upright ? x : y) - middle) / zoom,
                         across = middle_across + ((upright ? y : x) - middle_across) / zoom;
            const double off = double(carried.means.mean(0)[1]) - 1 - square_covered(along, across, 1 / zoom, edge);
            found += off * off;
            expected += double(carried.bias2);
          }
        }
      }
      std::printf("zoom %g %s: expected over found %.2f\n", zoom, upright ? "along x" : "along y", expected / found);
      EXPECT_GT(expected / found, 0.6);
      EXPECT_LT(expected / found, zoom < 1 ? 7 : 1.4);
    }
  }
}

}  // namespace
}  // namespace helio::test
