// A BVH's memory is counted for its own scene, before it is allocated, whatever else is built or freed meanwhile.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "renderer/base/memory_ledger.h"
#include "renderer/trace/accel.h"

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

TEST(AccelMemory, BuildsThatWaitForAnotherOneCanBeCancelled) {
  const Grid grid(10);
  CancelToken cancel;
  std::promise<void> building, go_on;
  Ledger ledger(~std::uint64_t(0), [&] {
    building.set_value();
    go_on.get_future().wait();
  });
  auto first = std::async(std::launch::async, [&] { return Accel::build(grid.input(&ledger)).ok(); });
  building.get_future().wait();
  auto second = std::async(std::launch::async, [&] {
    AccelInput input = grid.input();
    input.cancel = &cancel;
    return Accel::build(input).error().code;
  });
  cancel.cancel();
  // The limit only ends a hang: without looking at the token the second build waits for the first.
  const bool ended = second.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
  go_on.set_value();
  EXPECT_TRUE(ended);
  EXPECT_EQ(second.get(), ErrorCode::cancelled);
  EXPECT_TRUE(first.get());
}

}  // namespace
}  // namespace helio
