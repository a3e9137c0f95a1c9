// Which pictures are kept to be drawn on, and what a move makes of the film.
#include <gtest/gtest.h>

#include "renderer/film/core/film.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/stage_runner.h"
#include "renderer/frame/stages/centre_search.h"
#include "renderer/frame/stages/history_transfer.h"
#include "renderer/frame/tile_grid.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

CameraPose at(double x) {
  return camera_at({x, 0, 4}, {x, 0, 0});
}

// The film shows at(x), gets `samples`, and is left.
int leave(PictureHistory& history, double x, double samples) {
  history.film_complete(nullptr, at(x), true);
  const int slot = history.take_slot(samples);
  EXPECT_FALSE(history.slot(slot).valid);
  history.slot_complete(slot);
  history.film_overwritten();
  ++history.generation;
  return slot;
}

void run_all(FrameStage& stage) {
  TraceStats stats;
  StageRunner runner;
  runner.begin({std::shared_ptr<void>(), &stage});
  while (const auto item = runner.next()) {
    run(*item, stats);
    runner.finish(*item, true);
  }
  EXPECT_TRUE(runner.complete());
}

// Both plans of it.
void run_all(HistoryTransfer& transfer, const PixelRect& region) {
  run_all(transfer);
  EXPECT_FALSE(transfer.complete());
  transfer.resume(TileGrid(region, 16), false);
  run_all(transfer);
  EXPECT_TRUE(transfer.complete());
}

TEST(PictureHistory, APictureOfAQuarterOfItsSamplesReplacesTheAnchor) {
  PictureHistory history;
  EXPECT_FALSE(history.film_usable());
  const int first = leave(history, 1, 64);
  EXPECT_EQ(history.anchor(), first);
  for (const double x : {2.0, 3.0, 4.0}) {
    const int poor = leave(history, x, 15);
    EXPECT_NE(poor, first);
    EXPECT_EQ(history.slot(poor).pose, at(x));
    EXPECT_EQ(history.anchor(), first);
    EXPECT_EQ(history.slot(first).pose, at(1));
    EXPECT_TRUE(history.slot(first).valid);
  }
  const int rich = leave(history, 5, 16);
  EXPECT_NE(rich, first);
  EXPECT_EQ(history.anchor(), rich);
  EXPECT_EQ(history.slot(first).pose, at(1));  // stays until the next is left
  const int next = leave(history, 6, 1);
  EXPECT_EQ(next, first);
  EXPECT_EQ(history.anchor(), rich);
}

TEST(PictureHistory, ASlotThatWasNotCompletedIsNoPicture) {
  PictureHistory history;
  const int first = leave(history, 1, 64);
  history.film_complete(nullptr, at(2), true);
  const int taken = history.take_slot(64);
  EXPECT_FALSE(history.slot(taken).valid);
  EXPECT_EQ(history.anchor(), first);
  history.forget();
  EXPECT_FALSE(history.slot(first).valid);
  EXPECT_FALSE(history.film_usable());
}

TEST(PictureHistory, RemembersWhichLineageAFilmIs) {
  PictureHistory history;
  EXPECT_FALSE(history.slot(leave(history, 1, 1)).swapped);
  EXPECT_TRUE(history.slot(leave(history, 2, 1)).swapped);
  EXPECT_FALSE(history.slot(leave(history, 3, 1)).swapped);
}

TEST(HistoryTransfer, SamplesOfTheFirstHalfFeedBothWhileTheCameraMoves) {
  SceneDescription description;
  description.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(description, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
  const auto scene = build(description);
  Film film(20, 16, {.history = true});
  PictureHistory history;
  constexpr int kMoves = 9;
  for (int move = 0; move < kMoves; ++move) {
    // A wall that is the same everywhere: nothing is lost on the way.
    HistoryTransfer transfer(scene, film, film.bounds(), history, at(0.01 * move), {}, move == 0 ? 0 : 1,
                             PathSettings());
    run_all(transfer);
    // What centres of the first picture meet is looked for when it is left; later ones know.
    EXPECT_EQ(transfer.sweeps(), move == 0 ? 0 : (move == 1 ? 5 : 2));
    transfer.resume(TileGrid(film.bounds(), 16), false);
    run_all(transfer);
    EXPECT_TRUE(transfer.complete());
    EXPECT_EQ(transfer.sweeps(), 1);
    EXPECT_EQ(history.centres_known(), move > 0);
    ++history.generation;
    for (int y = 0; y < film.height(); ++y) {
      for (int x = 0; x < film.width(); ++x) film.half(0, x, y).add(Rgb(1, 1, 1));
    }
  }
  EXPECT_EQ(film.half(0, 10, 8).count, 5u);
  EXPECT_EQ(film.half(1, 10, 8).count, 4u);
  EXPECT_DOUBLE_EQ(film.half(1, 10, 8).sum[1], 4);
}

// What a picture that began from nothing finds out about its centres is what one that drew on others knew.
TEST(CentreSearch, FindsWhatCarryingDoes) {
  SceneDescription description;
  description.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0.2f, 0.5f, 0.1f))};
  add_mesh(description, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
  add_mesh(description, box({-0.5f, -1, 0.2f}, {0.1f, 0.4f, 0.8f}, 1));
  const auto scene = build(description);
  for (const PixelRect& region : {PixelRect{0, 0, 90, 40}, PixelRect{7, 9, 60, 33}}) {
    Film searched(90, 40, {.history = true}), carried(90, 40, {.history = true});
    PictureHistory history;
    HistoryTransfer first(scene, searched, region, history, at(0.3), {}, 0, PathSettings());
    run_all(first, region);
    EXPECT_EQ(first.stats().rays, 0u);
    EXPECT_FALSE(history.centres_known());
    searched.half(0, 20, 20).add(Rgb(1, 2, 3));  // it has begun
    CentreSearch search(searched, region, history, {});
    run_all(search);
    EXPECT_TRUE(history.centres_known());
    EXPECT_EQ(searched.features(20, 20).count, 0u) << "centres are no samples";
    EXPECT_EQ(searched.half(0, 20, 20).count, 1u);

    Reprojection reprojection(scene, carried, region, at(0.3), {}, {});
    ReprojectionStats stats;
    for (const PixelRect& window : transfer_windows(region)) reprojection.carry(window, stats);
    for (const PixelRect& window : transfer_windows(region)) reprojection.find_borders(window, stats);
    for (const PixelRect& window : transfer_windows(region)) reprojection.settle(window, stats);
    PictureState picture;
    search.note(picture);
    EXPECT_EQ(picture.search_rays, stats.rays);
    int borders = 0;
    for (int y = region.y0; y < region.y1; ++y) {
      for (int x = region.x0; x < region.x1; ++x) {
        const CentreHit &here = searched.history()->centre(x, y), &there = carried.history()->centre(x, y);
        EXPECT_EQ(here.depth, there.depth);
        EXPECT_EQ(here.instance, there.instance);
        EXPECT_EQ(here.normal, there.normal);
        EXPECT_EQ(here.albedo, there.albedo);
        EXPECT_EQ(here.border, there.border);
        EXPECT_EQ(searched.history()->carried(x, y).found(), 0u);
        borders += here.border;
      }
    }
    EXPECT_GT(borders, 20);
  }
}

}  // namespace
}  // namespace helio::test
