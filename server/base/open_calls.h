// Calls that a drain ends at once, because nobody could use what they wait for: a scene that is being loaded, a stream
// that was not opened yet.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace helio {

// Thread safe.
class OpenCalls {
 public:
  // A call's place in the list, which it keeps for as long as it may be ended so.
  using Place = std::shared_ptr<const std::function<void()>>;

  // `end` is called by end_all(), on its thread, or by add() itself where end_all() was called before. It may still be
  // called while the place is given up on another thread, so it holds what it uses, weakly.
  [[nodiscard]] Place add(std::function<void()> end);
  // Those of now, and each that is added later.
  void end_all();

 private:
  static constexpr std::size_t kFirstSweep = 64;

  std::mutex mutex_;
  bool ended_ = false;
  std::vector<std::weak_ptr<const std::function<void()>>> calls_;
  std::size_t sweep_at_ = kFirstSweep;  // calls_ of that size is rid of those that are over
};

}  // namespace helio
