// A BVH's memory is counted for its own scene, before it is allocated, whatever else is built or freed meanwhile.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "renderer/base/memory_ledger.h"
#include "renderer/trace/accel/accel.h"

namespace helio {
namespace {

// Counts, refuses what is beyond `limit`, and calls `first` once, when it is first asked.
class Ledger final : public MemoryLedger {
 public:
  explicit Ledger(std::uint64_t limit = ~std::uint64_t(0), std::function<void()> first = {})
      : limit_(limit), first_(std::move(first)) {}

  bool grow(std::uint64_t bytes) noexcept override {
    if (!asked_.exchange(true) && first_) first_();
    const std::lock_guard lock(mutex_);
    if (bytes > limit_ - held_) return false;
    held_ += bytes;
    peak_ = std::max(peak_, held_);
    return true;
  }
  void shrink(std::uint64_t bytes) noexcept override {
    const std::lock_guard lock(mutex_);
    EXPECT_LE(bytes, held_);
    held_ -= bytes;
  }
  std::uint64_t held() const override {
    const std::lock_guard lock(mutex_);
    return held_;
  }
  std::uint64_t peak() const {
    const std::lock_guard lock(mutex_);
    return peak_;
  }
  Error refusal(std::uint64_t bytes, const std::string& what) const override {
    return {ErrorCode::resource_exhausted, "ledger: " + std::to_string(bytes) + " for " + what, {}};
  }

 private:
  const std::uint64_t limit_;
  const std::function<void()> first_;
  std::atomic<bool> asked_{false};
  mutable std::mutex mutex_;
  std::uint64_t held_ = 0, peak_ = 0;
};

// side x side quads in the plane z = 0.
struct Grid {
  explicit Grid(int side) {
    const auto n = std::uint32_t(side + 1);
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) positions.emplace_back(float(x), float(y), 0.0f);
    }
    for (std::uint32_t y = 0; y + 1 < n; ++y) {
      for (std::uint32_t x = 0; x + 1 < n; ++x) {
        const std::uint32_t at = y * n + x;
        indices.insert(indices.end(), {at, at + 1, at + n, at + 1, at + n + 1, at + n});
      }
    }
    positions.reserve(positions.size() + 2);
  }

  AccelInput input(MemoryLedger* ledger = nullptr) const {
    AccelInput input;
    AccelPart& part = input.flat.emplace_back();
    part.positions = positions.data();
    part.vertex_count = std::size_t(positions.size());
    part.indices = indices.data();
    part.triangle_count = indices.size() / 3;
    input.threads = 1;
    input.ledger = ledger;
    return input;
  }

  std::vector<V3f> positions;
  std::vector<std::uint32_t> indices;
};

TEST(AccelMemory, WhatAnotherSceneFreesMeanwhileIsNotItsOwn) {
  const Grid grid(100);
  auto alone = Accel::build(grid.input());
  ASSERT_TRUE(alone.ok());
  const std::size_t bytes = (*alone)->memory_bytes();
  ASSERT_GT(bytes, 100'000u);
  // The other scene is as large as this one, and goes while this one is built.
  Ledger ledger(~std::uint64_t(0), [&] { std::thread([&] { alone->reset(); }).join(); });
  const auto built = Accel::build(grid.input(&ledger));
  ASSERT_TRUE(built.ok());
  EXPECT_EQ((*built)->memory_bytes(), bytes);
  EXPECT_GE(ledger.held(), bytes);
}

TEST(AccelMemory, IsTakenFromTheLedgerBeforeItIsAllocated) {
  const Grid grid(100);
  Ledger all;
  ASSERT_TRUE(Accel::build(grid.input(&all)).ok());
  EXPECT_GE(all.peak(), all.held());
  for (const std::uint64_t limit : {all.peak() - 1, all.peak() / 2, std::uint64_t(1)}) {
    Ledger less(limit);
    const auto refused = Accel::build(grid.input(&less));
    ASSERT_FALSE(refused.ok()) << limit;
    EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
    EXPECT_NE(refused.error().message.find("ledger: "), std::string::npos) << refused.error().message;
    EXPECT_LE(less.peak(), limit);
    EXPECT_EQ(less.held(), 0u) << "what was built is gone";
  }
}

// A build that stands still where it first allocates until go_on().
class StuckBuild {
 public:
  explicit StuckBuild(const Grid& grid)
      : ledger_(~std::uint64_t(0), [this] {
          begun_.set_value();
          goes_on_.get_future().wait();
        }) {
    built_ = std::async(std::launch::async, [this, &grid] { return Accel::build(grid.input(&ledger_)).ok(); });
    begun_.get_future().wait();
  }
  // The bytes that it holds in the end; 0: it failed.
  std::uint64_t go_on() {
    goes_on_.set_value();
    return built_.get() ? ledger_.held() : 0;
  }

 private:
  std::promise<void> begun_, goes_on_;
  Ledger ledger_;
  std::future<bool> built_;
};

// The limit only ends a hang.
bool ends(const std::future<std::optional<ErrorCode>>& build) {
  return build.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
}

TEST(AccelMemory, ABuildDoesNotWaitForAnotherOneAndEachIsCountedAlone) {
  const Grid grid(100), small(10);
  Ledger alone, small_alone;
  ASSERT_TRUE(Accel::build(grid.input(&alone)).ok());
  ASSERT_TRUE(Accel::build(small.input(&small_alone)).ok());
  StuckBuild load(grid);
  Ledger beside;
  auto edit = std::async(std::launch::async, [&] {
    const auto built = Accel::build(small.input(&beside));
    return built.ok() ? std::nullopt : std::optional(built.error().code);
  });
  EXPECT_TRUE(ends(edit));
  EXPECT_EQ(load.go_on(), alone.held());
  EXPECT_EQ(edit.get(), std::nullopt);
  EXPECT_EQ(beside.held(), small_alone.held());
}

TEST(AccelMemory, BuildsThatWaitForOthersCanBeCancelled) {
  const Grid grid(10);
  std::deque<StuckBuild> most;
  for (int i = 0; i < 8; ++i) most.emplace_back(grid);
  CancelToken cancel;
  auto waits = std::async(std::launch::async, [&] {
    AccelInput input = grid.input();
    input.cancel = &cancel;
    const auto built = Accel::build(input);
    return built.ok() ? std::nullopt : std::optional(built.error().code);
  });
  cancel.cancel();
  EXPECT_TRUE(ends(waits));
  for (StuckBuild& build : most) EXPECT_GT(build.go_on(), 0u);
  EXPECT_EQ(waits.get(), ErrorCode::cancelled);
}

}  // namespace
}  // namespace helio
