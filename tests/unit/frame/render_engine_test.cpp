// Sharing and latency of the workers.
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include "fake_integrator.h"
#include "latency.h"
#include "recording_sink.h"
#include "renderer/frame/render_engine.h"
#include "renderer/frame/render_loop.h"

namespace helio {
namespace {

std::unique_ptr<RenderLoop> endless_loop(RenderEngine& engine, const FakeIntegrator& integrator, int side,
                                         RenderRank rank, std::shared_ptr<FrameSink> sink) {
  auto loop =
      std::make_unique<RenderLoop>(engine, integrator.function(), film_of(side, side), Budget{}, rank, std::move(sink));
  RenderLoop::Update update;
  update.view = view_at(1, 0);
  loop->update(update);
  return loop;
}

TEST(RenderEngine, ThreadCount) {
  EXPECT_EQ(RenderEngine(3).threads(), 3);
  EXPECT_GE(RenderEngine(0).threads(), 1);
}

// Throws what it is given, once.
struct ThrowingSource final : PieceSource {
  std::function<void()> raise;
  std::promise<std::string> told;
  std::atomic<bool> raised{false};
  bool run_piece() override {
    if (!raised.exchange(true)) raise();
    return false;
  }
  bool failed(std::string reason) noexcept override {
    told.set_value(std::move(reason));
    return false;
  }
};

TEST(RenderEngine, WhatAPieceThrowsIsToldToItsSourceAlone) {
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  FakeIntegrator integrator;
  const auto bystander = endless_loop(engine, integrator, 64, RenderRank::interactive, sink);
  const std::string text = "a text that is longer than what a string holds by itself";
  const std::pair<std::function<void()>, std::string> cases[] = {{[] { throw std::bad_alloc(); }, "out of memory"},
                                                                 {[&] { throw std::runtime_error(text); }, text},
                                                                 {[] { throw 7; }, "unknown error"}};
  for (const auto& [raise, reason] : cases) {
    ThrowingSource source;
    source.raise = raise;
    const auto id = engine.impl().add(source, RenderRank::interactive);
    engine.impl().wake(id);
    EXPECT_EQ(source.told.get_future().get(), reason);
    engine.impl().remove(id);
  }
  const std::size_t tiles = sink->read([&] { return sink->tiles.size(); });
  EXPECT_TRUE(sink->wait([&] { return sink->tiles.size() > tiles; })) << "no worker is left";
}

TEST(RenderEngine, IdleWorkersSleep) {
  RenderEngine engine(4);
  const auto sink = std::make_shared<RecordingSink>();
  FakeIntegrator integrator;
  Budget budget;
  budget.samples = 4;
  RenderLoop loop(engine, integrator.function(), film_of(64, 64), budget, RenderRank::interactive, sink);
  RenderLoop::Update update;
  update.view = view_at(1, 0);
  ASSERT_TRUE(sink->wait_for_end(loop.update(update)));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const double before = process_cpu_s();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_LT(process_cpu_s() - before, 0.003) << "1 % of one core";
}

// Counts how often it is asked, and has nothing to do.
struct CountingSource final : PieceSource {
  std::atomic<int> asked{0};
  bool run_piece() override {
    ++asked;
    return false;
  }
  bool failed(std::string) noexcept override { return false; }
};

TEST(RenderEngine, WakesAtATime) {
  RenderEngine owner(1);
  RenderEngine::Impl& engine = owner.impl();
  CountingSource source, late;
  const FairQueue::Id id = engine.add(source, RenderRank::interactive);
  const FairQueue::Id late_id = engine.add(late, RenderRank::interactive);
  engine.wake_at(late_id, now_s() + 1e9);
  const double at = now_s() + 0.02;
  engine.wake_at(id, at);
  while (source.asked == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_GE(now_s(), at);
  engine.wake_at(id, now_s() + 1e9);
  engine.wake_at(id, now_s() - 1);  // the newest counts, and may be in the past
  while (source.asked == 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  engine.wake_at(id, now_s() + 0.01);
  engine.remove(id);  // and so is not asked again
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(source.asked, 2);
  EXPECT_EQ(late.asked, 0);
  engine.remove(late_id);
}

TEST(RenderEngine, OthersWaitWhileALoopHoldsTheEngine) {
  RenderEngine engine(2);
  FakeIntegrator for_holder, for_other;
  for_holder.seconds_per_sample = for_other.seconds_per_sample = 1e-6;
  auto holder = endless_loop(engine, for_holder, 256, RenderRank::job, std::make_shared<RecordingSink>());
  const auto other = endless_loop(engine, for_other, 256, RenderRank::interactive, std::make_shared<RecordingSink>());
  const auto goes_on = [&] {
    const double before = other->used_seconds(), deadline = now_s() + 60;
    while (other->used_seconds() == before && now_s() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return other->used_seconds() > before;
  };
  ASSERT_TRUE(goes_on());
  holder->hold_others(3600);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // pieces in flight end
  const double used = other->used_seconds(), own = holder->used_seconds();
  while (holder->used_seconds() < own + 0.1) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(other->used_seconds(), used);
  // Although the holder has nothing to do, until it lets go, its time is over, or it is gone.
  holder->cancel();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(other->used_seconds(), used);
  holder->release_others();
  EXPECT_TRUE(goes_on());
  const double held = now_s();
  holder->hold_others(0.05);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(goes_on());
  EXPECT_GE(now_s() - held, 0.02);
  holder->hold_others(3600);
  holder.reset();
  EXPECT_TRUE(goes_on());
}

TEST(RenderEngine, EightLoopsShareEvenly) {
  RenderEngine engine(2);
  std::vector<FakeIntegrator> integrators(8);
  std::vector<std::unique_ptr<RenderLoop>> loops;
  for (std::size_t i = 0; i < integrators.size(); ++i) {
    integrators[i].seconds_per_sample = 1e-6;
    loops.push_back(
        endless_loop(engine, integrators[i], 160, RenderRank::interactive, std::make_shared<RecordingSink>()));
  }
  // Of all loops at one time: again where the machine took the core away between the first and the last.
  const auto used_seconds = [&] {
    std::vector<double> used;
    for (double asked = -1; asked < 0 || process_cpu_s() - asked > 0.002;) {
      used.clear();
      asked = process_cpu_s();
      for (const auto& loop : loops) used.push_back(loop->used_seconds());
    }
    return used;
  };
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  std::vector<double> used = used_seconds();
  // Until every loop should have had 0.4 s, about 130 pieces.
  const double enough = std::accumulate(used.begin(), used.end(), 8 * 0.4);
  std::vector<double> used_now = used;
  while (std::accumulate(used_now.begin(), used_now.end(), 0.0) < enough) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    used_now = used_seconds();
  }
  for (std::size_t i = 0; i < loops.size(); ++i) used[i] = used_now[i] - used[i];
  const auto [least, most] = std::minmax_element(used.begin(), used.end());
  EXPECT_LT(*most, 1.1 * *least);
}

// By processor time, of one worker: which of two has work whenever it asks.
TEST(RenderEngine, AJobBesideAnEndlessSessionGetsItsShare) {
  RenderEngine engine(1);
  FakeIntegrator for_job, for_session;
  for_job.seconds_per_sample = for_session.seconds_per_sample = 1e-6;
  const auto job = endless_loop(engine, for_job, 256, RenderRank::job, std::make_shared<RecordingSink>());
  auto session = endless_loop(engine, for_session, 256, RenderRank::interactive, std::make_shared<RecordingSink>());
  const auto sum = [&] { return job->used_seconds() + session->used_seconds(); };
  while (sum() < 0.1) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double before = job->used_seconds(), sum_before = sum();
  while (sum() < sum_before + 0.5) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double share = (job->used_seconds() - before) / (sum() - sum_before);
  EXPECT_GT(share, 0.08);
  EXPECT_LT(share, 0.15);
  session.reset();
  const std::uint64_t samples = for_job.counters->samples;
  while (for_job.counters->samples == samples) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(RenderEngine, CancelTakesEffectInTime) {
  RenderEngine engine(2);
  FakeIntegrator integrator;
  integrator.seconds_per_sample = 20e-6;
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, integrator.function(), film_of(512, 512), {}, RenderRank::interactive, sink);
  std::vector<double> delays;
  for (int i = 0; i < 100; ++i) {
    RenderLoop::Update update;
    update.view = view_at(std::uint64_t(i), i);
    const std::uint64_t revision = loop.update(update);
    ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty() && sink->begins.back().tag.revision == revision; }));
    std::this_thread::sleep_for(std::chrono::microseconds(1500 + 97 * i));
    const double asked = process_cpu_s();
    loop.cancel();
    ASSERT_TRUE(sink->wait_for_end(revision));
    delays.push_back(sink->read([&] { return sink->end_cpu.back(); }) - asked);
  }
  EXPECT_LT(percentile_90(delays), allowed_work_s(2));
  EXPECT_GT(integrator.counters->cancelled, 10u) << "nothing was in flight when it was cancelled";
}

TEST(RenderEngine, ANewViewTakesEffectInTime) {
  RenderEngine engine(2);
  FakeIntegrator integrator;
  integrator.seconds_per_sample = 20e-6;
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, integrator.function(), film_of(512, 512), {}, RenderRank::interactive, sink);
  std::vector<double> delays;
  for (int i = 0; i < 100; ++i) {
    RenderLoop::Update update;
    update.view = view_at(std::uint64_t(i), i);
    const double asked = process_cpu_s();
    const std::uint64_t revision = loop.update(update);
    ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty() && sink->begins.back().tag.revision == revision; }));
    delays.push_back(sink->read([&] { return sink->begin_cpu.back(); }) - asked);
    std::this_thread::sleep_for(std::chrono::microseconds(1500 + 97 * i));
  }
  EXPECT_LT(percentile_90(delays), allowed_work_s(2));
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
}

}  // namespace
}  // namespace helio
