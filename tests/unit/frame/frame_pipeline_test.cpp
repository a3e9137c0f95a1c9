// The pipeline obeys its plan: order of the stages, deadline, early tiles, room.
#include "renderer/frame/frame_pipeline.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "renderer/film/core/sample_targets.h"
#include "renderer/frame/stages/estimate_error.h"
#include "renderer/frame/window_order.h"

namespace helio {
namespace {

constexpr double kNow = 100;

// The first letter of the stage.
char kind(const Piece& piece) {
  return *to_string(stage_of(piece));
}

// A stage of two sweeps: of three parts and of none. It writes down what is asked of it.
class NotedStage final : public FrameStage {
 public:
  NotedStage(StageId id, std::string& course) : FrameStage(id), course_(course) {}
  int sweeps() const override { return 2; }
  std::size_t parts() const override { return sweep_ == 0 ? 3 : 0; }
  void run(int sweep, std::size_t part, TraceStats&) override {
    write_down(std::to_string(sweep) + "." + std::to_string(part));
  }
  void finish_sweep(int sweep) override {
    sweep_ = sweep + 1;
    write_down(std::to_string(sweep) + "/");
  }
  void finished(TileGrid&) override { write_down("!"); }

 private:
  void write_down(const std::string& what) { course_ += std::string(" ") + *to_string(id()) + what; }

  std::string& course_;
  int sweep_ = 0;
};

class FramePipelineTest : public ::testing::Test {
 protected:
  FramePipelineTest() {
    pipeline.set_grid(film.bounds(), 64);
    pipeline.begin_frame();
  }

  // Does what the piece says, in place of a worker.
  void carry_out(const Piece& piece, double now = kNow) {
    if (const auto* p = std::get_if<IntegratePiece>(&piece)) {
      for (int y = p->window.y0; y < p->window.y1; ++y)
        for (int x = p->window.x0; x < p->window.x1; ++x)
          for (std::uint32_t i = 0; i < p->range.count; ++i) written->half(p->range.half, x, y).add(Rgb(float(x + i)));
    } else if (const auto* item = std::get_if<StageItem>(&piece)) {
      TraceStats stats;
      run(*item, stats);
    }
    pipeline.finish(piece, true, 1e-4, now);
  }

  // The kinds of the pieces, one at a time until the plan is over; runs of one kind are written once.
  std::string course() {
    std::string kinds;
    while (const auto piece = pipeline.take(true, kNow)) {
      if (kinds.empty() || kinds.back() != kind(*piece)) kinds += kind(*piece);
      carry_out(*piece);
    }
    EXPECT_TRUE(pipeline.over());
    EXPECT_EQ(pipeline.in_flight(), 0);
    return kinds;
  }

  // The plan is begun with what estimates errors, if it asks for that.
  void start() {
    FrameStages stages;
    if (plan.asks(StageId::measure)) {
      estimate = std::make_shared<EstimateError>(film, film.bounds());
      stages.after = {estimate};
    }
    pipeline.start(plan, film, std::move(stages));
  }

  Film film{128, 64};  // two tiles
  Film* written = &film;
  std::shared_ptr<EstimateError> estimate;
  FramePipeline pipeline{2, 1e-3};
  FramePlan plan;
};

TEST_F(FramePipelineTest, IntegratesThenMeasuresThenPublishes) {
  plan.target[0] = plan.target[1] = 2;
  plan.after = {StageId::measure};
  plan.publish = Publish::round;
  start();
  EXPECT_EQ(course(), "imr");
  EXPECT_FALSE(pipeline.cut());
  std::uint32_t done[kHalves];
  pipeline.grid().done_everywhere(done);
  EXPECT_EQ(done[0], 2u);
  EXPECT_EQ(done[1], 2u);
  EXPECT_EQ(estimate->result().rmse, estimate_error(film, film.bounds()).rmse);
  EXPECT_FALSE(pipeline.published_final());
}

TEST_F(FramePipelineTest, DoesOnlyWhatThePlanAsks) {
  start();
  EXPECT_EQ(course(), "");
  plan.target[0] = 1;
  start();
  EXPECT_EQ(course(), "i");
  EXPECT_TRUE(pipeline.finished_stages().empty());
  plan.target[0] = 0;
  plan.publish = Publish::round;
  plan.final = true;
  start();
  EXPECT_EQ(course(), "r");
  EXPECT_TRUE(pipeline.published_final());
  start();
  EXPECT_EQ(course(), "") << "a final tile is not published again";
}

TEST_F(FramePipelineTest, EarlyTilesComeAsSoonAsTheyAreDone) {
  plan.target[0] = 1;
  plan.publish = Publish::early;
  start();
  EXPECT_EQ(course(), "irir");
}

TEST_F(FramePipelineTest, AnEarlyTileReadsNothingOutsideItself) {
  plan.target[0] = 1;
  plan.publish = Publish::early;
  start();
  while (const auto piece = pipeline.take(true, kNow)) {
    if (const auto* r = std::get_if<ResolvePiece>(&*piece)) {
      EXPECT_EQ(r->roi, r->window);
    }
    carry_out(*piece);
  }
  plan.publish = Publish::round;
  start();
  const auto piece = pipeline.take(true, kNow);
  ASSERT_TRUE(piece && kind(*piece) == 'r');
  EXPECT_EQ(std::get<ResolvePiece>(*piece).roi, film.bounds());
}

TEST_F(FramePipelineTest, AStageWaitsForThePiecesInFlight) {
  plan.target[0] = 1;
  plan.publish = Publish::round;
  start();
  const auto held = pipeline.take(true, kNow);
  while (const auto piece = pipeline.take(true, kNow)) {
    ASSERT_EQ(kind(*piece), 'i');
    carry_out(*piece);
  }
  EXPECT_FALSE(pipeline.over());
  EXPECT_FALSE(pipeline.may_take(true));
  carry_out(*held);
  EXPECT_TRUE(pipeline.may_take(true));
  EXPECT_EQ(course(), "r");
}

TEST_F(FramePipelineTest, TheDeadlineCutsThePlan) {
  plan.target[0] = 1;
  plan.after = {StageId::measure};
  plan.publish = Publish::round;
  plan.deadline_s = kNow + 1;
  start();
  const auto in_time = pipeline.take(true, kNow);
  ASSERT_TRUE(in_time.has_value());
  EXPECT_FALSE(pipeline.take(true, kNow + 1).has_value());
  EXPECT_FALSE(pipeline.over()) << "a piece is in flight";
  carry_out(*in_time, kNow + 1.001);
  EXPECT_FALSE(pipeline.take(true, kNow + 1.001).has_value());
  EXPECT_TRUE(pipeline.over());
  EXPECT_TRUE(pipeline.cut());
}

TEST_F(FramePipelineTest, PiecesShrinkTowardsTheDeadline) {
  plan.target[0] = 1;
  start();
  course();  // learns the cost: 1e-4 s a piece
  plan.target[0] = 1000;
  start();
  const auto far = pipeline.take(true, kNow);
  plan.deadline_s = kNow + 1e-4;
  pipeline.stop();
  pipeline.finish(*far, false, 0, kNow);
  start();
  const auto near = pipeline.take(true, kNow);
  EXPECT_LE(std::get<IntegratePiece>(*near).samples * 5, std::get<IntegratePiece>(*far).samples);
  pipeline.finish(*near, false, 0, kNow);
}

TEST_F(FramePipelineTest, WithoutRoomNothingIsResolved) {
  plan.publish = Publish::round;
  start();
  EXPECT_FALSE(pipeline.take(false, kNow).has_value());
  EXPECT_FALSE(pipeline.over());
  EXPECT_FALSE(pipeline.may_take(false));
  EXPECT_TRUE(pipeline.may_take(true));
  EXPECT_EQ(course(), "r");
}

TEST_F(FramePipelineTest, StopDropsWhatIsNotInFlight) {
  plan.target[0] = plan.target[1] = 4;
  plan.after = {StageId::measure};
  plan.publish = Publish::round;
  start();
  const auto held = pipeline.take(true, kNow);
  pipeline.stop();
  EXPECT_TRUE(pipeline.over());
  EXPECT_EQ(pipeline.in_flight(), 1);
  EXPECT_FALSE(pipeline.take(true, kNow).has_value());
  carry_out(*held);
  EXPECT_EQ(pipeline.in_flight(), 0);
  // What the piece added is known, so the next plan does not add it again.
  start();
  EXPECT_EQ(course(), "imr");
  for (int h = 0; h < kHalves; ++h) EXPECT_EQ(film.half(h, 0, 0).count, 4u);
}

// Any list of stages, in the order of the plan. Whatever they are: nothing but their owner knows them.
TEST_F(FramePipelineTest, RunsStagesInTheOrderOfThePlan) {
  std::string noted;
  plan.before = {StageId::allocate, StageId::reproject};
  plan.after = {StageId::choose};
  plan.target[0] = 1;
  FrameStages stages;
  for (const StageRequest& request : plan.before)
    stages.before.push_back(std::make_shared<NotedStage>(request.id, noted));
  stages.after = {std::make_shared<NotedStage>(StageId::choose, noted)};
  pipeline.start(plan, film, stages);
  EXPECT_EQ(course(), "aric");
  EXPECT_EQ(noted,
            " a0.0 a0.1 a0.2 a0/ a1/ a! r0.0 r0.1 r0.2 r0/ r1/ r! c0.0 c0.1 c0.2 c0/ c1/ c!");
  EXPECT_EQ(pipeline.finished_stages().size(), 3u);
}

TEST_F(FramePipelineTest, AStageThatIsStoppedByTheClockIsWaitedForAndPassed) {
  std::string noted;
  plan.before = {StageId::choose};
  plan.before[0].until_s = kNow + 1;
  plan.target[0] = 1;
  pipeline.start(plan, film, {{std::make_shared<NotedStage>(StageId::choose, noted)}, {}});
  const auto held = pipeline.take(true, kNow);
  ASSERT_TRUE(held);
  EXPECT_FALSE(pipeline.take(true, kNow + 2)) << "nothing is integrated while a part of it runs";
  carry_out(*held, kNow + 2);
  EXPECT_EQ(noted, " c0.0");
  EXPECT_EQ(course(), "i");
  EXPECT_EQ(pipeline.finished_stages().size(), 1u) << "its turn is over";
  EXPECT_EQ(pipeline.seconds(StageId::choose), 0);
}

TEST_F(FramePipelineTest, TheEndOfASweepIsAPieceOfItsOwn) {
  std::string noted;
  plan.before = {StageId::choose};
  pipeline.start(plan, film, {{std::make_shared<NotedStage>(StageId::choose, noted)}, {}});
  for (int part = 0; part < 3; ++part) carry_out(*pipeline.take(true, kNow));
  EXPECT_TRUE(pipeline.may_take(true));
  const auto end = pipeline.take(true, kNow);
  ASSERT_TRUE(end && std::get<StageItem>(*end).ends_sweep);
  EXPECT_FALSE(pipeline.may_take(true));
  // Stopped meanwhile: it ends all the same, and nothing follows.
  pipeline.stop();
  carry_out(*end);
  EXPECT_EQ(noted, " c0.0 c0.1 c0.2 c0/");
  EXPECT_TRUE(pipeline.over());
  EXPECT_EQ(pipeline.in_flight(), 0);
}

// A stage whose one sweep makes the tiles ready one after the other. With targets it asks for a sample of every pixel
// of the second.
class TiledStage final : public FrameStage {
 public:
  TiledStage(const TileGrid& grid, SampleTargets* targets)
      : FrameStage(StageId::allocate), order_(windows(grid)), second_(grid.tiles()[1].window), targets_(targets) {}
  int sweeps() const override { return 1; }
  std::size_t parts() const override { return order_.parts(); }
  WindowOrder* order() override { return &order_; }
  void run(int, std::size_t part, TraceStats&) override {
    const auto [sweep, window] = order_.part(part);
    if (sweep + 1 < WindowOrder::kSweeps || !targets_) return;
    const bool asked = second_.contains(window.x0, window.y0);
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) {
        targets_->set_target(0, x, y, asked);
        targets_->block(x, y) = {{0, 0}, {asked, 0}};
      }
    }
  }
  void finish_sweep(int) override {}

 private:
  static std::vector<PixelRect> windows(const TileGrid& grid) {
    std::vector<PixelRect> tiles;
    for (const Tile& tile : grid.tiles()) tiles.push_back(tile.window);
    return tiles;
  }

  WindowOrder order_;
  PixelRect second_;
  SampleTargets* targets_;
};

class TileByTile : public FramePipelineTest {
 protected:
  TileByTile() {
    written = &wide;
    pipeline.set_grid(wide.bounds(), 64);
    pipeline.begin_frame();
    plan.before = {StageId::allocate};
    plan.by_tile = true;
    plan.target[0] = 1;
    plan.publish = Publish::early;
  }
  void start(bool targets) {
    plan.round = targets;
    pipeline.start(plan, wide,
                   {{std::make_shared<TiledStage>(pipeline.grid(), targets ? wide.targets() : nullptr)}, {}});
  }

  Film wide{64 * 5, 64, {.targets = true}};  // five tiles
};

TEST_F(TileByTile, SamplesAndPublicationFollowTheStage) {
  start(false);
  EXPECT_EQ(course(), "airairairairaira");
  std::uint32_t done[kHalves];
  pipeline.grid().done_everywhere(done);
  EXPECT_EQ(done[0], 1u);
  EXPECT_FALSE(pipeline.cut());
}

TEST_F(TileByTile, InARoundAsTheStageHasSetTheTargets) {
  start(true);
  EXPECT_EQ(course(), "arairararara") << "samples of the second tile alone";
}

TEST_F(TileByTile, PixelsThatTheStagePreparedAreNotCleared) {
  start(false);
  while (const auto piece = pipeline.take(true, kNow)) {
    if (const auto* p = std::get_if<IntegratePiece>(&*piece)) {
      EXPECT_FALSE(p->clear);
    }
    pipeline.finish(*piece, true, 1e-4, kNow);
  }
  EXPECT_TRUE(pipeline.over());
}

// The stage comes to its end, for there is nothing else to show; tiles that lack samples are not shown as if they had
// them.
TEST_F(TileByTile, TheDeadlineEndsSamplesButNotTheStage) {
  plan.deadline_s = kNow + 1;
  const auto late_course = [&] {
    std::string kinds;
    while (const auto piece = pipeline.take(true, kNow + 2)) {
      if (kinds.empty() || kinds.back() != kind(*piece)) kinds += kind(*piece);
      carry_out(*piece, kNow + 2);
    }
    EXPECT_TRUE(pipeline.over());
    EXPECT_TRUE(pipeline.cut());
    return kinds;
  };
  start(true);
  EXPECT_EQ(late_course(), "arararara") << "all tiles but the second, which lacks samples";
  pipeline.forget_samples();
  start(false);
  EXPECT_EQ(late_course(), "a") << "all lack samples";
}

// A stage that turns out to have no order is waited for.
TEST_F(TileByTile, WithoutAnOrderAllTilesComeAfterTheStage) {
  std::string noted;
  pipeline.start(plan, wide, {{std::make_shared<NotedStage>(StageId::allocate, noted)}, {}});
  EXPECT_EQ(course(), "aiririririr");
}

}  // namespace
}  // namespace helio
