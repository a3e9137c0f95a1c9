#include "renderer/frame/stages/integrate.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>

namespace helio {
namespace {

FramePlan plan_to(std::uint32_t a, std::uint32_t b, bool final = false) {
  FramePlan plan;
  plan.target[0] = a;
  plan.target[1] = b;
  plan.final = final;
  return plan;
}

const Film kNoTargets(1, 1);  // nothing of it is looked at

// Carries the pieces out by counting, several in flight, finished in random order; some are thrown away.
class Worker {
 public:
  Worker(IntegratePass& pass, TileGrid& grid, int in_flight, unsigned seed)
      : pass_(pass), grid_(grid), in_flight_(in_flight), random_(seed) {}

  void run(double seconds_per_sample, double share_thrown_away) {
    for (;;) {
      while (int(pieces_.size()) < in_flight_) {
        EXPECT_EQ(pass_.any_open(), has_open());
        const auto piece = pass_.next(grid_, 1e-3);
        if (!piece) break;
        for (const auto& other : pieces_) EXPECT_TRUE(intersect(other.window, piece->window).empty());
        pieces_.push_back(*piece);
        largest_ = std::max(largest_, double(piece->samples) * seconds_per_sample);
      }
      if (pieces_.empty()) return;
      std::swap(pieces_[random_() % pieces_.size()], pieces_.back());
      const IntegratePiece piece = pieces_.back();
      pieces_.pop_back();
      const bool done = std::uniform_real_distribution<>()(random_) >= share_thrown_away;
      const Tile& tile = grid_.tiles()[piece.tile];
      for (int c = piece.column; c < piece.column + piece.cells; ++c)
        EXPECT_EQ(grid_.cell(tile, c, piece.row).done[piece.range.half], piece.range.first) << "out of index order";
      pass_.finish(piece, done, double(piece.samples) * seconds_per_sample, grid_);
      ++count_;
    }
  }

  double largest() const { return largest_; }
  int count() const { return count_; }

 private:
  bool has_open() const {
    TileGrid copy = grid_;
    IntegratePass pass = pass_;
    return pass.next(copy, 1).has_value();
  }

  IntegratePass& pass_;
  TileGrid& grid_;
  int in_flight_;
  std::mt19937 random_;
  std::deque<IntegratePiece> pieces_;
  double largest_ = 0;
  int count_ = 0;
};

TEST(IntegratePass, EveryCellReachesTheTargetInIndexOrder) {
  for (const int in_flight : {1, 2, 5}) {
    TileGrid grid(PixelRect{3, 5, 100, 90}, 32);
    IntegratePass pass(in_flight);
    std::uint32_t done[kHalves];
    for (const auto& [a, b] : {std::pair{1u, 0u}, {1u, 1u}, {8u, 8u}, {100u, 99u}}) {
      pass.begin(plan_to(a, b), grid, kNoTargets);
      EXPECT_FALSE(pass.finished());
      Worker(pass, grid, in_flight, a).run(1e-6, 0.1);
      EXPECT_TRUE(pass.finished());
      grid.done_everywhere(done);
      EXPECT_EQ(done[0], a);
      EXPECT_EQ(done[1], b);
      for (std::size_t t = 0; t < grid.tiles().size(); ++t) EXPECT_TRUE(pass.tile_finished(t));
    }
  }
}

TEST(IntegratePass, PiecesFollowTheMeasuredCost) {
  for (const double cost : {1e-7, 1e-6, 1e-5}) {
    TileGrid grid(PixelRect{0, 0, 256, 256}, 128);
    IntegratePass pass(2);
    pass.begin(plan_to(1, 0), grid, kNoTargets);
    Worker(pass, grid, 2, 1).run(cost, 0);  // learns the cost
    pass.begin(plan_to(64, 64), grid, kNoTargets);
    Worker worker(pass, grid, 2, 2);
    worker.run(cost, 0);
    const double smallest = cost * kCellSize * kCellSize;  // one sample of one cell is never cut
    EXPECT_LE(worker.largest(), std::max(1.05e-3, 1.01 * smallest)) << "asked for pieces of 1 ms";
    EXPECT_GE(worker.largest(), 0.5e-3);
  }
}

TEST(IntegratePass, ASmallPictureIsSharedByManyWorkers) {
  TileGrid grid(PixelRect{0, 0, 64, 64}, 128);
  IntegratePass pass(16);
  pass.begin(plan_to(64, 64), grid, kNoTargets);
  Worker worker(pass, grid, 16, 1);
  worker.run(1e-8, 0);
  EXPECT_GE(worker.count(), 64);
}

TEST(IntegratePass, StopHandsOutNothingMore) {
  TileGrid grid(PixelRect{0, 0, 64, 64}, 64);
  IntegratePass pass(2);
  pass.begin(plan_to(1, 0), grid, kNoTargets);
  const auto piece = pass.next(grid, 1e-3);
  ASSERT_TRUE(piece.has_value());
  pass.stop();
  EXPECT_FALSE(pass.any_open());
  EXPECT_FALSE(pass.next(grid, 1e-3).has_value());
  EXPECT_FALSE(pass.finished());
  pass.finish(*piece, true, 1e-3, grid);
  EXPECT_TRUE(pass.finished());
  EXPECT_FALSE(pass.any_open());
  EXPECT_FALSE(pass.tile_finished(0));
}

TEST(IntegratePass, FinalPlanClearsWhatWasNeverReached) {
  Film film(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (int h = 0; h < kHalves; ++h) film.half(h, x, y).add(Rgb(7));  // of an older picture
  TileGrid grid(film.bounds(), 64);
  IntegratePass pass(1);
  const IntegrateFunction none = [](const IntegrateJob&, const CancelToken&, Film&, TraceStats&) -> bool {
    throw std::logic_error("nothing is to be traced");
  };
  pass.begin(plan_to(0, 0, true), grid, kNoTargets);
  CancelToken cancel;
  TraceStats stats;
  while (const auto piece = pass.next(grid, 1)) {
    EXPECT_TRUE(run_integrate(*piece, none, {}, {}, cancel, film, stats));
    pass.finish(*piece, true, 0, grid);
  }
  EXPECT_TRUE(pass.finished());
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (int h = 0; h < kHalves; ++h) ASSERT_EQ(film.half(h, x, y).count, 0u);
}

}  // namespace
}  // namespace helio
