// A render loop's checkpoints: when the next is due, the memory that they are made in, and who holds the newest.
//
// Not thread safe: the loop's lock guards all but keep().
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>

#include "renderer/frame/checkpoint/checkpoint_clock.h"
#include "renderer/frame/picture_checkpoint.h"
#include "renderer/frame/render_settings.h"

namespace helio {

struct CheckpointOptions {
  // Seconds between two of them at least, >= 0. It grows so that they take at most 2 % of the render time. 0: only when
  // RenderLoop::checkpoint_soon() asks.
  double interval_s = 60;
  // Called by a worker while no sample is added: returns at once, having stored the pointer. The next one is not begun
  // before everybody has let go of it. It may outlive the loop. What is thrown fails the frame.
  std::function<void(std::shared_ptr<const PictureCheckpoint>)> keep = {};
  // What the caller counts checkpoint_bytes() by: released once that memory has been freed.
  std::shared_ptr<const void> count = {};
  // No memory for checkpoints, and none are made, before RenderLoop::prepare_checkpoints(), or an update of the
  // settings: clearing it takes as long as clearing a film, and a first sample would wait for both.
  bool prepare_later = false;
  // Told how many seconds samples stood still for one; by a worker, with the loop's lock held: it returns at once and
  // throws nothing.
  std::function<void(double seconds)> paused = {};
};

class CheckpointMaker {
 public:
  // Memory for one checkpoint; null where the settings have none.
  struct Memory {
    std::shared_ptr<const void> count;  // released after the checkpoint
    PictureCheckpoint checkpoint;
  };
  // Throws std::bad_alloc.
  std::shared_ptr<Memory> make_memory(const RenderSettings& settings) const;

  CheckpointMaker(CheckpointOptions options, const RenderSettings& settings);

  // Whether a memory, or the newest, does for these settings.
  static bool suits(const std::shared_ptr<Memory>& memory, const RenderSettings& settings);
  bool suits(const RenderSettings& settings) const { return suits(memory_, settings); }
  // From the next checkpoint on, as of make_memory(). Returns what is of no use any more.
  std::shared_ptr<Memory> set_memory(std::shared_ptr<Memory> memory) noexcept;

  CheckpointClock clock;
  void tell_pause(double seconds) const {
    if (options_.paused) options_.paused(seconds);
  }
  // There is memory, and nobody holds what it has.
  bool free() const { return memory_ && !held_->load(std::memory_order_acquire); }
  const std::shared_ptr<Memory>& memory() const { return memory_; }
  std::size_t bytes() const { return memory_ ? memory_->checkpoint.bytes() : 0; }

  // What hands the checkpoint in `memory` over, once it is complete. Thread safe.
  std::function<void()> keeper(const std::shared_ptr<Memory>& memory) const;

 private:
  CheckpointOptions options_;
  std::shared_ptr<Memory> memory_;
  std::shared_ptr<std::atomic<bool>> held_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace helio
