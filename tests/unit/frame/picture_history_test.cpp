// Which pictures are kept to be drawn on, and what a move makes of the film.
#include <gtest/gtest.h>

#include "renderer/film/core/film.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/stage_runner.h"
#include "renderer/frame/stages/history_transfer.h"
#include "renderer/frame/tile_grid.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

CameraPose at(double x) {
  return camera_at({x, 0, 4}, {x, 0, 0});
}

// The same everywhere.
std::shared_ptr<const RenderScene> wide_wall() {
  SceneDescription description;
  description.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(description, quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0));
  return build(description);
}

// The film shows at(x), gets `samples`, and is left.
int leave(PictureHistory& history, double x, double samples) {
  history.film_complete(nullptr, at(x));
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
  history.film_complete(nullptr, at(2));
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

// From its first part on the film is no picture, not even of a camera that none can be drawn from.
TEST(HistoryTransfer, AFilmThatIsBeingOverwrittenIsNoPicture) {
  const auto scene = wide_wall();
  Film film(20, 16, {.history = true});
  PictureHistory history;
  CameraPose lens = at(0);
  lens.lens_radius = 0.1;
  history.film_complete(scene, lens);
  HistoryTransfer transfer(scene, film, film.bounds(), history, at(0), {}, 1, PathSettings());
  run_all(transfer);
  EXPECT_TRUE(history.film_usable()) << "nothing has touched it yet";
  transfer.resume(TileGrid(film.bounds(), 16), false);
  EXPECT_FALSE(history.film_usable());
  run_all(transfer);
  EXPECT_TRUE(history.film_usable());
}

TEST(HistoryTransfer, SamplesOfTheFirstHalfFeedBothWhileTheCameraMoves) {
  const auto scene = wide_wall();
  Film film(20, 16, {.history = true});
  PictureHistory history;
  constexpr int kMoves = 9;
  for (int move = 0; move < kMoves; ++move) {
    // Nothing is lost on the way.
    HistoryTransfer transfer(scene, film, film.bounds(), history, at(0.01 * move), {}, move == 0 ? 0 : 1,
                             PathSettings());
    run_all(transfer);
    EXPECT_EQ(transfer.sweeps(), move == 0 ? 0 : 2);
    transfer.resume(TileGrid(film.bounds(), 16), false);
    run_all(transfer);
    EXPECT_TRUE(transfer.complete());
    EXPECT_EQ(transfer.sweeps(), 1);
    ++history.generation;
    for (int y = 0; y < film.height(); ++y) {
      for (int x = 0; x < film.width(); ++x) film.half(0, x, y).add(Rgb(1, 1, 1));
    }
  }
  EXPECT_EQ(film.half(0, 10, 8).count, 5u);
  EXPECT_EQ(film.half(1, 10, 8).count, 4u);
  EXPECT_DOUBLE_EQ(film.half(1, 10, 8).sum[1], 4);
}

}  // namespace
}  // namespace helio::test
