#include "server/sessions/job_quota.h"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "server/base/retry.h"

namespace helio {

Status JobQuota::check(const Caller& caller) {
  std::uint64_t count = jobs_.held_by(caller.name);
  if (kept_) {
    const auto kept = kept_(caller.name);
    if (!kept) return kept.error();
    count += *kept;
  }
  {
    const std::lock_guard lock(taken_->mutex);
    const auto found = taken_->by_owner.find(caller.name);
    if (found != taken_->by_owner.end()) count += found->second;
  }
  if (count < *caller.quotas.jobs) return ok_status();
  return Error{ErrorCode::resource_exhausted,
               fmt::format("quota jobs of the token '{}': {} wait, are paused or run; allowed: {}", caller.name, count,
                           *caller.quotas.jobs),
               {},
               kRetrySeconds};
}

Result<JobQuota::Place> JobQuota::take(const Caller& caller) {
  return add(caller, [&]() -> Result<Place> {
    {
      const std::lock_guard lock(taken_->mutex);
      ++taken_->by_owner[caller.name];
    }
    return Place(nullptr, [taken = taken_, name = caller.name](void*) {
      const std::lock_guard lock(taken->mutex);
      const auto found = taken->by_owner.find(name);
      if (--found->second == 0) taken->by_owner.erase(found);
    });
  });
}

}  // namespace helio
