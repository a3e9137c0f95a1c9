// When a render loop makes its next checkpoint. Reads no clock.
#pragma once

#include <algorithm>
#include <cstdint>

namespace helio {

class CheckpointClock {
 public:
  // Of render time, what checkpoints that nobody asks for may take.
  static constexpr double kMostShare = 0.02;
  // What one takes before one was made: its bytes at this rate.
  static constexpr double kAssumedBytesPerSecond = 4e9;

  // interval_s: between two at least, >= 0; 0: only when asked.
  explicit CheckpointClock(double interval_s) : interval_s_(interval_s) {}

  // Of so many bytes from now on.
  void set_size(std::uint64_t bytes) {
    bytes_ = bytes;
    seconds_ = 0;
  }
  // A frame begins: the first one of a loop, or after a pause.
  void begin(double now_s) { next_s_ = std::max(next_s_, now_s + pause_s()); }
  // At the next occasion.
  void ask() { ++asked_; }
  bool asked() const { return asked_ > answered_; }  // and nobody was answered
  bool due(double now_s) const { return asked() || (interval_s_ > 0 && now_s >= next_s_); }

  // One begins; those who ask from now on mean the next one. It may never end.
  void begun() { answering_ = asked_; }
  // It has ended, and samples stood still for so long.
  void ended(double seconds, double now_s) {
    answered_ = answering_;
    seconds_ = seconds;
    next_s_ = now_s + pause_s();
  }

 private:
  double pause_s() const {
    const double cost = seconds_ > 0 ? seconds_ : double(bytes_) / kAssumedBytesPerSecond;
    return std::max(interval_s_, cost * (1 / kMostShare - 1));
  }

  double interval_s_;
  std::uint64_t bytes_ = 0;
  double seconds_ = 0;  // of the newest; 0: none of this size yet
  double next_s_ = 0;
  std::uint64_t asked_ = 0, answering_ = 0, answered_ = 0;
};

}  // namespace helio
