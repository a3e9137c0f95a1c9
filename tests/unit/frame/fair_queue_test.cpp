#include "renderer/frame/fair_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// Workers beside each other, for so many seconds of a clock of its own.
std::vector<double> run_workers(FairQueue& queue, int workers, double seconds,
                                const std::vector<std::pair<FairQueue::Id, double>>& costs) {
  struct Worker {
    FairQueue::Id id = 0;  // 0: none
    double free_s = 0, cost = 0;
  };
  std::vector<double> before, used;
  for (const auto& [id, cost] : costs) before.push_back(queue.used_seconds(id));
  std::vector<Worker> all(std::size_t(workers), Worker{});
  for (;;) {
    Worker& next = *std::min_element(all.begin(), all.end(),
                                     [](const Worker& a, const Worker& b) { return a.free_s < b.free_s; });
    if (next.id != 0) queue.finish(next.id, next.cost);
    next.id = 0;
    if (next.free_s >= seconds) break;
    next.id = *queue.take();
    for (const auto& [candidate, cost] : costs) {
      if (candidate == next.id) next.cost = cost;
    }
    next.free_s += next.cost;
  }
  for (const Worker& worker : all) {
    if (worker.id != 0) queue.finish(worker.id, worker.cost);
  }
  for (std::size_t i = 0; i < costs.size(); ++i) used.push_back(queue.used_seconds(costs[i].first) - before[i]);
  return used;
}

TEST(FairQueue, EmptyHasNoTurn) {
  FairQueue queue({1});
  EXPECT_FALSE(queue.take().has_value());
  const auto id = queue.add(0);
  EXPECT_FALSE(queue.take().has_value()) << "not ready";
  queue.set_ready(id, true);
  EXPECT_TRUE(queue.any_ready());
  EXPECT_EQ(queue.take(), id);
  EXPECT_EQ(queue.in_flight(id), 1);
  queue.finish(id, 0.25);
  EXPECT_EQ(queue.used_seconds(id), 0.25);
  queue.remove(id);
  EXPECT_FALSE(queue.any_ready());
}

// However many clients each has; a client's turns are those of its owner, in each group.
TEST(FairQueue, OwnersShareTheirGroupEvenly) {
  FairQueue queue({8, 1});
  std::vector<std::pair<FairQueue::Id, double>> costs;
  const auto add = [&](std::size_t group, const char* owner, double cost) {
    costs.emplace_back(queue.add(group, owner), cost);
    queue.set_ready(costs.back().first, true);
  };
  for (int i = 0; i < 6; ++i) add(0, "alice", 0.001);
  add(0, "bob", 0.004);
  add(1, "alice", 0.002);
  add(1, "carol", 0.003);
  for (const int workers : {1, 4}) {
    const std::vector<double> used = run_workers(queue, workers, 40, costs);
    const double all = 40.0 * workers;
    const double alice = used[0] + used[1] + used[2] + used[3] + used[4] + used[5];
    EXPECT_NEAR(alice / all, 4.0 / 9, 0.01) << workers;
    EXPECT_NEAR(used[6] / all, 4.0 / 9, 0.01) << workers;
    EXPECT_NEAR(used[7] / all, 0.5 / 9, 0.01) << workers;
    EXPECT_NEAR(used[8] / all, 0.5 / 9, 0.01) << workers;
    for (int i = 1; i < 6; ++i) EXPECT_NEAR(used[std::size_t(i)], used[0], 0.02 * used[0]);
  }
}

// Nor does an owner who was idle, or who opens and closes sessions, get more.
TEST(FairQueue, OwnersSaveUpNoCredit) {
  FairQueue queue({1});
  const auto busy = queue.add(0, "alice"), idle = queue.add(0, "bob");
  queue.set_ready(busy, true);
  run(queue, 1000, {{busy, 0.001}});
  queue.set_ready(idle, true);
  std::vector<double> used = run(queue, 1000, {{busy, 0.001}, {idle, 0.001}});
  EXPECT_NEAR(used[0], used[1], 0.01);
  queue.set_ready(idle, false);
  queue.remove(idle);
  const auto again = queue.add(0, "bob");
  queue.set_ready(again, true);
  used = run(queue, 1000, {{busy, 0.001}, {again, 0.001}});
  EXPECT_NEAR(used[0], used[1], 0.01);
}

TEST(FairQueue, WhoHoldsItHasEveryTurn) {
  FairQueue queue({8, 1});
  const auto first = queue.add(0), neighbour = queue.add(1), holder = queue.add(1);
  for (const auto id : {first, neighbour, holder}) queue.set_ready(id, true);
  queue.hold(holder);
  EXPECT_EQ(queue.holder(), holder);
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(queue.take(), holder);
    queue.finish(holder, 1);
  }
  queue.set_ready(holder, false);
  EXPECT_FALSE(queue.any_ready()) << "others wait although it does nothing";
  EXPECT_FALSE(queue.take().has_value());
  queue.hold(std::nullopt);
  EXPECT_EQ(queue.take(), first);
  queue.finish(first, 1);
  queue.hold(holder);
  queue.remove(holder);
  EXPECT_TRUE(queue.any_ready()) << "it holds no longer";
}

// What one had while nobody else had a turn is neither owed afterwards nor makes others wait who begin then.
TEST(FairQueue, AfterAHoldTurnsGoOnAsBefore) {
  FairQueue queue({8, 1});
  const auto session = queue.add(0), job = queue.add(1, "bob"), holder = queue.add(1, "alice");
  for (const auto id : {session, job, holder}) queue.set_ready(id, true);
  queue.hold(holder);
  for (int i = 0; i < 600; ++i) {
    ASSERT_EQ(queue.take(), holder);
    queue.finish(holder, 1);
  }
  EXPECT_EQ(queue.used_seconds(holder), 600);
  queue.hold(std::nullopt);
  const auto late = queue.add(1, "carol");
  queue.set_ready(late, true);
  const auto used = run(queue, 3000, {{session, 0.001}, {job, 0.001}, {holder, 0.001}, {late, 0.001}});
  EXPECT_NEAR(used[0], 8.0 / 9 * 3, 0.05);
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(used[std::size_t(i)], 1.0 / 27 * 3, 0.02);
}

TEST(FairQueue, TimeIsSharedEvenlyWhateverThePiecesCost) {
  FairQueue queue({1});
  std::vector<std::pair<FairQueue::Id, double>> costs;
  for (int i = 0; i < 8; ++i) {
    costs.push_back({queue.add(0), 0.5e-3 * (i + 1)});  // 0.5 to 4 ms
    queue.set_ready(costs.back().first, true);
  }
  const auto used = run(queue, 20000, costs);
  const double mean = 20000 * 8 * 0.5e-3 / (8 * (1 + .5 + 1. / 3 + .25 + .2 + 1. / 6 + 1. / 7 + .125));
  for (const double u : used) EXPECT_NEAR(u, mean, 0.01 * mean);
}

// Sessions beside jobs: 8 to 1 of the whole, however many there are of either and whatever their pieces cost.
TEST(FairQueue, GroupsShareInProportionAndClientsEvenly) {
  for (const int workers : {1, 4}) {
    for (const int sessions : {1, 5}) {
      for (const int jobs : {1, 2, 7}) {
        FairQueue queue({8, 1});
        std::vector<std::pair<FairQueue::Id, double>> costs;
        for (int i = 0; i < sessions + jobs; ++i) {
          costs.push_back({queue.add(i < sessions ? 0 : 1), i < sessions ? 1e-3 : 4e-3 - 1e-4 * i});
          queue.set_ready(costs.back().first, true);
        }
        const auto used = run_workers(queue, workers, 20, costs);
        for (int i = 0; i < sessions + jobs; ++i) {
          const double share = i < sessions ? 8.0 / 9 / sessions : 1.0 / 9 / jobs;
          EXPECT_NEAR(used[std::size_t(i)], share * workers * 20, 0.02 * share * workers * 20)
              << workers << " workers, " << sessions << " sessions, " << jobs << " jobs: " << i;
        }
      }
    }
  }
}

// A session that wakes up goes before jobs until it has had its share, and a job is not made to wait longer than that.
TEST(FairQueue, AGroupThatWakesUpGoesFirst) {
  FairQueue queue({8, 1});
  const auto session = queue.add(0), job = queue.add(1), other_job = queue.add(1);
  queue.set_ready(job, true);
  queue.set_ready(other_job, true);
  run(queue, 2000, {{job, 2e-3}, {other_job, 2e-3}});
  for (int burst = 0; burst < 10; ++burst) {
    queue.set_ready(session, true);
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(queue.take(), session) << "burst " << burst << ", piece " << i;
      queue.finish(session, 1e-3);
    }
    queue.set_ready(session, false);
    run(queue, 5, {{job, 2e-3}, {other_job, 2e-3}});
  }
  // Minutes of the session alone earns the jobs nothing but their share from then on, and the reverse.
  queue.set_ready(job, false);
  queue.set_ready(other_job, false);
  queue.set_ready(session, true);
  run(queue, 100000, {{session, 2e-3}});
  queue.set_ready(job, true);
  const auto used = run(queue, 900, {{session, 2e-3}, {job, 2e-3}});
  EXPECT_NEAR(used[1] / (used[0] + used[1]), 1.0 / 9, 0.01);
}

TEST(FairQueue, IdlingSavesUpNoCredit) {
  FairQueue queue({1});
  const auto busy = queue.add(0), idler = queue.add(0);
  queue.set_ready(busy, true);
  run(queue, 1000, {{busy, 1e-3}});  // a second ahead
  queue.set_ready(idler, true);
  const auto used = run(queue, 1000, {{busy, 1e-3}, {idler, 1e-3}});
  EXPECT_NEAR(used[0], 0.5, 0.01);
  EXPECT_NEAR(used[1], 0.5, 0.01);
}

TEST(FairQueue, WaitingForAPieceInFlightIsNotIdling) {
  FairQueue queue({1});
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
  FairQueue queue({1});
  const auto a = queue.add(0), b = queue.add(0);
  queue.set_ready(a, true);
  queue.set_ready(b, true);
  EXPECT_NE(queue.take(), queue.take()) << "two workers took the same client while the other waited";
}

}  // namespace
}  // namespace helio
