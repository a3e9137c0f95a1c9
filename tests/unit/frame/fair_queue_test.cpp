#include "renderer/frame/fair_queue.h"

#include <gtest/gtest.h>

#include <vector>

namespace helio {
namespace {

// One worker that does nothing else: `pieces` turns, each as long as its client's pieces are.
std::vector<double> run(FairQueue& queue, int pieces, const std::vector<std::pair<FairQueue::Id, double>>& costs) {
  std::vector<double> before, used;
  for (const auto& [id, cost] : costs) before.push_back(queue.used_seconds(id));
  for (int i = 0; i < pieces; ++i) {
    const auto id = queue.take();
    EXPECT_TRUE(id.has_value());
    for (const auto& [candidate, cost] : costs) {
      if (candidate == *id) queue.finish(*id, cost);
    }
  }
  for (std::size_t i = 0; i < costs.size(); ++i) used.push_back(queue.used_seconds(costs[i].first) - before[i]);
  return used;
}

TEST(FairQueue, EmptyHasNoTurn) {
  FairQueue queue;
  EXPECT_FALSE(queue.take().has_value());
  const auto id = queue.add(0);
  EXPECT_FALSE(queue.take().has_value()) << "not ready";
  queue.set_ready(id, true);
  EXPECT_TRUE(queue.any_ready());
  EXPECT_EQ(queue.take(), id);
  EXPECT_EQ(queue.in_flight(id), 1);
  queue.finish(id, 0.25);
  EXPECT_EQ(queue.used_seconds(id), 0.25);
}

TEST(FairQueue, TimeIsSharedEvenlyWhateverThePiecesCost) {
  FairQueue queue;
  std::vector<std::pair<FairQueue::Id, double>> costs;
  for (int i = 0; i < 8; ++i) {
    costs.push_back({queue.add(0), 0.5e-3 * (i + 1)});  // 0.5 to 4 ms
    queue.set_ready(costs.back().first, true);
  }
  const auto used = run(queue, 20000, costs);
  const double mean = 20000 * 8 * 0.5e-3 / (8 * (1 + .5 + 1. / 3 + .25 + .2 + 1. / 6 + 1. / 7 + .125));
  for (const double u : used) EXPECT_NEAR(u, mean, 0.01 * mean);
}

TEST(FairQueue, WeightsShareInProportion) {
  FairQueue queue;
  const auto one = queue.add(0, 1), three = queue.add(0, 3);
  queue.set_ready(one, true);
  queue.set_ready(three, true);
  const auto used = run(queue, 4000, {{one, 1e-3}, {three, 1e-3}});
  EXPECT_NEAR(used[1] / used[0], 3, 0.02);
}

TEST(FairQueue, LowerRankGoesFirst) {
  FairQueue queue;
  const auto job = queue.add(1), session = queue.add(0);
  queue.set_ready(job, true);
  EXPECT_EQ(queue.take(), job);
  queue.finish(job, 1e-3);
  queue.set_ready(session, true);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(queue.take(), session);
    queue.finish(session, 5e-3);
  }
  queue.set_ready(session, false);
  EXPECT_EQ(queue.take(), job);
}

TEST(FairQueue, IdlingSavesUpNoCredit) {
  FairQueue queue;
  const auto busy = queue.add(0), idler = queue.add(0);
  queue.set_ready(busy, true);
  run(queue, 1000, {{busy, 1e-3}});  // a second ahead
  queue.set_ready(idler, true);
  const auto used = run(queue, 1000, {{busy, 1e-3}, {idler, 1e-3}});
  EXPECT_NEAR(used[0], 0.5, 0.01);
  EXPECT_NEAR(used[1], 0.5, 0.01);
}

TEST(FairQueue, WaitingForAPieceInFlightIsNotIdling) {
  FairQueue queue;
  const auto behind = queue.add(0), busy = queue.add(0);
  queue.set_ready(behind, true);
  queue.set_ready(busy, true);
  ASSERT_EQ(queue.take(), behind);
  queue.set_ready(behind, false);  // its only piece is in flight
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(queue.take(), busy);
    queue.finish(busy, 1e-3);
  }
  queue.set_ready(behind, true);
  queue.finish(behind, 1e-3);
  // It used 1 ms while the other used 100: the next 98 or so turns are its own.
  int turns = 0;
  while (queue.take() == behind) {
    queue.finish(behind, 1e-3);
    ++turns;
  }
  EXPECT_GE(turns, 90);
  EXPECT_LE(turns, 101);
}

TEST(FairQueue, AdvanceChargeSpreadsSimultaneousWorkers) {
  FairQueue queue;
  const auto a = queue.add(0), b = queue.add(0);
  queue.set_ready(a, true);
  queue.set_ready(b, true);
  EXPECT_NE(queue.take(), queue.take()) << "two workers took the same client while the other waited";
}

}  // namespace
}  // namespace helio
