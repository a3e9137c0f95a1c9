// The pipeline obeys its plan: order of the stages, deadline, early tiles, room.
#include "renderer/frame/frame_pipeline.h"

#include <gtest/gtest.h>

#include <string>

namespace helio {
namespace {

constexpr double kNow = 100;

char kind(const Piece& piece) {
  return std::holds_alternative<IntegratePiece>(piece) ? 'i' : std::holds_alternative<MeasurePiece>(piece) ? 'm' : 'r';
}

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
          for (std::uint32_t i = 0; i < p->range.count; ++i) film.half(p->range.half, x, y).add(Rgb(float(x + i)));
    } else if (const auto* m = std::get_if<MeasurePiece>(&piece)) {
      run_sweep(*m);
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

  Film film{128, 64};  // two tiles
  FramePipeline pipeline{2, 1e-3};
  FramePlan plan;
};

TEST_F(FramePipelineTest, IntegratesThenMeasuresThenPublishes) {
  plan.target[0] = plan.target[1] = 2;
  plan.measure = true;
  plan.publish = Publish::round;
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "imr");
  EXPECT_FALSE(pipeline.cut());
  std::uint32_t done[kHalves];
  pipeline.grid().done_everywhere(done);
  EXPECT_EQ(done[0], 2u);
  EXPECT_EQ(done[1], 2u);
  ASSERT_TRUE(pipeline.measured().has_value());
  EXPECT_EQ(pipeline.measured()->rmse, estimate_error(film, film.bounds()).rmse);
  EXPECT_FALSE(pipeline.published_final());
}

TEST_F(FramePipelineTest, DoesOnlyWhatThePlanAsks) {
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "");
  plan.target[0] = 1;
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "i");
  EXPECT_FALSE(pipeline.measured().has_value());
  plan.target[0] = 0;
  plan.publish = Publish::round;
  plan.final = true;
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "r");
  EXPECT_TRUE(pipeline.published_final());
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "") << "a final tile is not published again";
}

TEST_F(FramePipelineTest, EarlyTilesComeAsSoonAsTheyAreDone) {
  plan.target[0] = 1;
  plan.publish = Publish::early;
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "irir");
}

TEST_F(FramePipelineTest, AnEarlyTileReadsNothingOutsideItself) {
  plan.target[0] = 1;
  plan.publish = Publish::early;
  pipeline.start(plan, film);
  while (const auto piece = pipeline.take(true, kNow)) {
    if (const auto* r = std::get_if<ResolvePiece>(&*piece)) {
      EXPECT_EQ(r->roi, r->window);
    }
    carry_out(*piece);
  }
  plan.publish = Publish::round;
  pipeline.start(plan, film);
  const auto piece = pipeline.take(true, kNow);
  ASSERT_TRUE(piece && kind(*piece) == 'r');
  EXPECT_EQ(std::get<ResolvePiece>(*piece).roi, film.bounds());
}

TEST_F(FramePipelineTest, AStageWaitsForThePiecesInFlight) {
  plan.target[0] = 1;
  plan.measure = false;
  plan.publish = Publish::round;
  pipeline.start(plan, film);
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
  plan.measure = true;
  plan.publish = Publish::round;
  plan.deadline_s = kNow + 1;
  pipeline.start(plan, film);
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
  pipeline.start(plan, film);
  course();  // learns the cost: 1e-4 s a piece
  plan.target[0] = 1000;
  pipeline.start(plan, film);
  const auto far = pipeline.take(true, kNow);
  plan.deadline_s = kNow + 1e-4;
  pipeline.stop();
  pipeline.finish(*far, false, 0, kNow);
  pipeline.start(plan, film);
  const auto near = pipeline.take(true, kNow);
  EXPECT_LE(std::get<IntegratePiece>(*near).samples * 5, std::get<IntegratePiece>(*far).samples);
  pipeline.finish(*near, false, 0, kNow);
}

TEST_F(FramePipelineTest, WithoutRoomNothingIsResolved) {
  plan.publish = Publish::round;
  pipeline.start(plan, film);
  EXPECT_FALSE(pipeline.take(false, kNow).has_value());
  EXPECT_FALSE(pipeline.over());
  EXPECT_FALSE(pipeline.may_take(false));
  EXPECT_TRUE(pipeline.may_take(true));
  EXPECT_EQ(course(), "r");
}

TEST_F(FramePipelineTest, StopDropsWhatIsNotInFlight) {
  plan.target[0] = plan.target[1] = 4;
  plan.measure = true;
  plan.publish = Publish::round;
  pipeline.start(plan, film);
  const auto held = pipeline.take(true, kNow);
  pipeline.stop();
  EXPECT_TRUE(pipeline.over());
  EXPECT_EQ(pipeline.in_flight(), 1);
  EXPECT_FALSE(pipeline.take(true, kNow).has_value());
  carry_out(*held);
  EXPECT_EQ(pipeline.in_flight(), 0);
  // What the piece added is known, so the next plan does not add it again.
  pipeline.start(plan, film);
  EXPECT_EQ(course(), "imr");
  for (int h = 0; h < kHalves; ++h) EXPECT_EQ(film.half(h, 0, 0).count, 4u);
}

}  // namespace
}  // namespace helio
