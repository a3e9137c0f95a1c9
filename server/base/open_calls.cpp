#include "server/base/open_calls.h"

#include <algorithm>
#include <utility>

namespace helio {

OpenCalls::Place OpenCalls::add(std::function<void()> end) {
  Place place = std::make_shared<const std::function<void()>>(std::move(end));
  {
    const std::lock_guard lock(mutex_);
    if (!ended_) {
      if (calls_.size() >= sweep_at_) {
        std::erase_if(calls_, [](const auto& call) { return call.expired(); });
        sweep_at_ = std::max(kFirstSweep, 2 * calls_.size());
      }
      calls_.push_back(place);
      return place;
    }
  }
  (*place)();
  return place;
}

void OpenCalls::end_all() {
  std::vector<std::weak_ptr<const std::function<void()>>> calls;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    calls.swap(calls_);
  }
  for (const auto& call : calls) {
    if (const Place place = call.lock()) (*place)();
  }
}

}  // namespace helio
