// A move that is begun again, and one whose film is of no use by then.
#include "renderer/frame/paper/forward_transfer.h"

#include <gtest/gtest.h>

#include "renderer/frame/paper/hit_tracing.h"
#include "renderer/frame/paper/paper_film.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 32, kHeight = 24;

// Runs the sweeps [0, end) of a move; returns the pixels that have got something.
std::uint64_t run(ForwardTransfer& transfer, int end) {
  TraceStats stats;
  for (int sweep = 0; sweep < end; ++sweep) {
    for (std::size_t part = 0; part < transfer.parts(); ++part) transfer.run(sweep, part, stats);
    transfer.finish_sweep(sweep);
  }
  return transfer.stats().carried;
}

TEST(ForwardTransfer, GoesOnFromTheCopyUntilItIsForgotten) {
  const auto scene = build(lambert_room());
  const CameraPose home = camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60), there = turned_and_shifted(home, 1, 0);
  Film film(kWidth, kHeight, paper_film_state({.history = true}, 4));
  const PixelRect region = film.bounds();
  const Camera camera(home, kWidth, kHeight, scene->origin());
  const CancelToken never;
  TraceStats stats;
  for (int half = 0; half < kHalves; ++half)
    ASSERT_TRUE(trace_noting_hits(*scene, camera, {}, {half, 0, 2}, region, never, film, stats));
  PictureHistory history;
  const auto begin = [&] {
    return ForwardTransfer(scene, film, region, history, there, PixelFilter{}, kPaperMaxError);
  };

  EXPECT_EQ(begin().sweeps(), 1) << "nothing is known: the film is cleared";
  history.film_complete(nullptr, home);
  {
    ForwardTransfer interrupted = begin();
    ASSERT_EQ(interrupted.sweeps(), 3);
    run(interrupted, 1);
  }
  EXPECT_FALSE(history.film_usable());
  film.clear();
  {
    ForwardTransfer again = begin();
    ASSERT_EQ(again.sweeps(), 3);
    EXPECT_GT(run(again, 3), std::uint64_t(region.area()) / 2);
    EXPECT_TRUE(again.complete());
  }
  EXPECT_TRUE(history.film_usable());

  ForwardTransfer interrupted = begin();
  run(interrupted, 1);
  EXPECT_EQ(begin().sweeps(), 3);
  film.extension()->forget();
  EXPECT_EQ(begin().sweeps(), 1);
}

}  // namespace
}  // namespace helio::test
