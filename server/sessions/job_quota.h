// How many jobs a token may have: those that wait, are paused or run, of RunJob, of the daemon's keeping, and
// comparisons.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "renderer/base/result.h"
#include "server/base/access_tokens.h"
#include "server/sessions/job_store.h"

namespace helio {

// Thread safe.
class JobQuota {
 public:
  explicit JobQuota(JobStore& jobs) : jobs_(jobs) {}

  // Of the jobs that the daemon keeps: how many this owner has that are not at their end. Set before anything is
  // served; empty: none are kept.
  void count_kept_by(std::function<Result<std::uint64_t>(const std::string& owner)> kept) { kept_ = std::move(kept); }

  // Calls add(), which adds a job of this caller, unless there are as many as the quota allows; then
  // resource_exhausted. One call at a time for callers with a quota, so that two do not take one place; add() may wait
  // for the disk.
  template <class Add>
  auto add(const Caller& caller, const Add& add) -> decltype(add()) {
    if (!caller.quotas.jobs) return add();
    const std::lock_guard lock(mutex_);
    if (const Status free = check(caller); !free.ok()) return free.error();
    return add();
  }

  // The place of a comparison, until it is let go.
  using Place = std::shared_ptr<void>;
  Result<Place> take(const Caller& caller);

 private:
  Status check(const Caller& caller);

  struct Taken {
    std::mutex mutex;
    std::map<std::string, std::uint64_t> by_owner;
  };

  JobStore& jobs_;
  std::function<Result<std::uint64_t>(const std::string& owner)> kept_;
  std::mutex mutex_;
  const std::shared_ptr<Taken> taken_ = std::make_shared<Taken>();  // outlives the places
};

}  // namespace helio
