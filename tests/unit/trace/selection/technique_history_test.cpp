#include "renderer/trace/selection/technique_history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "renderer/trace/selection/pilot_render.h"
#include "tests/support/loop_views.h"
#include "tests/support/own_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 256, kHeight = 192;  // 8 x 6 tiles
using Scene = std::shared_ptr<const RenderScene>;

// All sweeps.
std::unique_ptr<PilotRender> probe(const Scene& scene, const CameraPose& pose, TechniqueHistory::Views known = {},
                                   const PixelRect& region = {}) {
  PathSettings settings;
  settings.region = region;
  auto work = std::make_unique<PilotRender>(scene, pose, kWidth, kHeight, settings, std::make_shared<CancelToken>(),
                                            std::move(known));
  for (int sweep = 0; sweep < work->sweeps(); ++sweep) {
    for (std::size_t part = 0; part < work->parts(); ++part) work->run(sweep, part);
    work->finish_sweep(sweep);
  }
  return work;
}

std::vector<bool> tiles_of(const PilotRender& work) {
  std::vector<bool> on;
  for (std::size_t t = 0; t < work.result().size(); ++t) {
    const PixelRect tile = work.result().window(t);
    on.push_back(work.result().on(tile.x0, tile.y0));
  }
  return on;
}

std::size_t probed_tiles(const PilotRender& work) {
  if (!work.probed()) return 0;
  const auto& tiles = work.probed()->tiles;
  return std::size_t(std::count_if(tiles.begin(), tiles.end(), [](const auto& tile) { return tile.has_value(); }));
}

class TechniqueMemory : public testing::Test {
 protected:
  Scene covered = load_own_scene("cornell-covered");
  CameraPose home = camera_pose(covered->description().cameras.at(0));
};

TEST_F(TechniqueMemory, AViewThatWasProbedIsNotProbedAgain) {
  const auto first = probe(covered, home);
  EXPECT_TRUE(first->whole());
  EXPECT_EQ(probed_tiles(*first), 48u);
  const auto again = probe(covered, home, {first->probed()});
  EXPECT_EQ(again->probed(), nullptr);
  EXPECT_EQ(tiles_of(*again), tiles_of(*first));
  EXPECT_TRUE(tiles_of(*first)[20]) << "light comes by way of the ceiling";
}

// Lenses are looked through their middle; what an orthographic camera has behind its plane hides nothing.
TEST_F(TechniqueMemory, LensesAndOrthographicCamerasKnowTheirOwnView) {
  CameraPose lens = home;
  lens.lens_radius = 0.3;
  lens.focus_distance = 0.5;
  CameraPose orthographic = camera_at({0, 0.1, 0.3}, {0, 0, -1});
  orthographic.projection = Projection::orthographic;
  orthographic.half_height = 0.4;
  SceneDescription closed;
  closed.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(5, 5, 5))};
  add_mesh(closed, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  add_mesh(closed, quad({-0.3f, 0.9f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1));
  const Scene room = build(std::move(closed));
  for (const auto& [scene, pose] : {std::pair(covered, lens), std::pair(room, orthographic)}) {
    const auto first = probe(scene, pose);
    ASSERT_EQ(probed_tiles(*first), 48u);
    const auto again = probe(scene, pose, {first->probed()});
    EXPECT_EQ(again->probed(), nullptr);
    EXPECT_EQ(tiles_of(*again), tiles_of(*first));
  }
}

// The dark side of a sheet is not the lit one.
TEST_F(TechniqueMemory, SurfacesSeenFromBehindAreProbed) {
  SceneDescription sheet;
  sheet.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(5, 5, 5))};
  add_mesh(sheet, quad({-8, -8, 0}, {16, 0, 0}, {0, 16, 0}, 0));
  add_mesh(sheet, quad({-1, 3, 2}, {2, 0, 0}, {0, 0, 2}, 1));
  const Scene scene = build(std::move(sheet));
  const auto before = probe(scene, camera_at({0, 0, 3}, {0, 0, 0}));
  ASSERT_EQ(probed_tiles(*before), 48u);
  EXPECT_EQ(probed_tiles(*probe(scene, camera_at({0, 0, -3}, {0, 0, 0}), {before->probed()})), 48u);
}

TEST_F(TechniqueMemory, AViewWithoutLightIsNotRemembered) {
  EXPECT_EQ(probe(covered, camera_at({0, 0, 1e4}, {0, 0, 2e4}))->probed(), nullptr);
}

// A camera that turns to the left meets what is new at the left edge, and the rest is known.
TEST_F(TechniqueMemory, WhatComesIntoViewIsProbed) {
  const CameraPose before = turned_and_shifted(home, -12, 0);
  const auto first = probe(covered, before);
  const auto moved = probe(covered, home, {first->probed()});
  ASSERT_TRUE(moved->probed());
  EXPECT_FALSE(moved->whole());
  EXPECT_EQ(moved->probed()->brightness, first->probed()->brightness);
  std::size_t measured = 0;
  for (std::size_t t = 0; t < 48; ++t) {
    if (!moved->probed()->tiles[t]) continue;
    ++measured;
    EXPECT_LT(t % 8, 5u) << t;
  }
  EXPECT_GE(measured, 6u);
  EXPECT_LE(measured, 24u);
  EXPECT_EQ(tiles_of(*moved), tiles_of(*probe(covered, home))) << "light paths pay everywhere in this box";
}

// What was not measured is not known afterwards: neither what an earlier view knew nor what is taken to be like it.
TEST_F(TechniqueMemory, OnlyWhatWasMeasuredIsKnown) {
  const auto first = probe(covered, home);
  ProbedView holes = *first->probed();
  holes.tiles[0].reset();
  for (std::size_t t = 0; t < 48; ++t) {
    if (t % 8 >= 5) holes.tiles[t].reset();
  }
  const auto again = probe(covered, home, {std::make_shared<const ProbedView>(holes)});
  ASSERT_TRUE(again->probed());
  const auto& tiles = again->probed()->tiles;
  EXPECT_FALSE(tiles[0]) << "all around it was known";
  EXPECT_FALSE(tiles[9]) << "known before";
  for (std::size_t row = 0; row < 6; ++row) EXPECT_TRUE(tiles[8 * row + 6] && tiles[8 * row + 7]) << row;
  EXPECT_TRUE(tiles_of(*again)[0]) << "and takes part in the choice";
}

// Steps too small to bring a tile into view take it to be like its neighbours; what such steps add up to is probed, for
// each asks the view that was probed and not the step before.
TEST_F(TechniqueMemory, SmallStepsAddUp) {
  TechniqueHistory history;
  int probed = 0;
  for (int step = 0; step <= 24; ++step) {
    const auto work =
        probe(covered, turned_and_shifted(home, -12 + 0.5 * step, 0), history.views(covered, kWidth, kHeight));
    if (work->probed()) {
      history.note(covered, work->probed(), work->whole());
      ++probed;
    }
    EXPECT_EQ(work->whole(), step == 0) << step;
  }
  EXPECT_GE(probed, 2);
  EXPECT_LE(probed, 8);
}

TEST_F(TechniqueMemory, WhatSomethingHidIsProbed) {
  SceneDescription room;
  room.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(5, 5, 5))};
  add_mesh(room, box({-2, -2, -4}, {2, 2, 2}, 0, true));
  add_mesh(room, quad({-0.5f, 1.9f, -2}, {1, 0, 0}, {0, 0, 1}, 1));
  add_mesh(room, quad({-0.5f, 1.9f, 0.5f}, {1, 0, 0}, {0, 0, 1}, 1));
  add_mesh(room, quad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, 0));  // a screen through the room, lit on both sides
  const Scene scene = build(std::move(room));
  const auto before = probe(scene, camera_at({0, 0, 1}, {0, 0, -1}));
  ASSERT_EQ(probed_tiles(*before), 48u);
  const auto behind = probe(scene, camera_at({0, 0, -0.1}, {0, 0, -1}), {before->probed()});
  EXPECT_EQ(probed_tiles(*behind), 48u);
}

TEST_F(TechniqueMemory, OtherScenesAndSizesAreForgotten) {
  TechniqueHistory history;
  EXPECT_TRUE(history.views(covered, kWidth, kHeight).empty());
  history.note(covered, probe(covered, home)->probed(), true);
  EXPECT_EQ(history.views(covered, kWidth, kHeight).size(), 1u);
  EXPECT_GT(history.bytes(), 48 * sizeof(TileEstimate));
  EXPECT_TRUE(history.views(covered, kWidth, kHeight + 1).empty());
  const Scene other = load_own_scene("cornell-box");
  EXPECT_TRUE(history.views(other, kWidth, kHeight).empty());
  history.note(other, probe(other, home)->probed(), false);
  EXPECT_EQ(history.views(other, kWidth, kHeight).size(), 1u);
  EXPECT_TRUE(history.views(covered, kWidth, kHeight).empty());
}

TEST_F(TechniqueMemory, ViewsDoNotPileUp) {
  TechniqueHistory history;
  const auto view = probe(covered, home)->probed();
  for (std::size_t i = 0; i < 3 * TechniqueHistory::kMostViews; ++i)
    history.note(covered, view, history.views(covered, kWidth, kHeight).empty());
  EXPECT_LT(history.bytes(), 2 * TechniqueHistory::kMostViews * 64 * sizeof(std::optional<TileEstimate>));
}

// Of a region the rest is neither probed nor asked for.
TEST_F(TechniqueMemory, ARegionKnowsItself) {
  const PixelRect region{40, 50, 140, 130};
  const auto first = probe(covered, home, {}, region);
  const auto again = probe(covered, home, {first->probed()}, region);
  EXPECT_EQ(again->probed(), nullptr);
  EXPECT_EQ(tiles_of(*again), tiles_of(*first));
  EXPECT_LT(probed_tiles(*first), 30u);
}

// The sky is as far from everywhere.
TEST_F(TechniqueMemory, WhatNoRayMeetsIsKnownByItsDirection) {
  SceneDescription open;
  open.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(open, quad({-1, 0, -1}, {2, 0, 0}, {0, 0, 2}, 0));
  open.environment.emplace().radiance = Rgb(1, 1, 1);
  const Scene scene = build(std::move(open));
  const auto before = probe(scene, camera_at({0, 1, 4}, {0, 2, 0}));
  const auto moved = probe(scene, camera_at({0.2, 1.1, 4}, {0.2, 2.1, 0}), {before->probed()});
  EXPECT_LT(probed_tiles(*moved), 24u);
}

}  // namespace
}  // namespace helio::test
