#include "server/sessions/job_store.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>

#include "renderer/base/clock.h"
#include "server/base/retry.h"
#include "server/sessions/session_registry.h"

namespace helio {

void Job::start_view() {
  const std::lock_guard lock(mutex_);
  if (stopped_) return;
  RenderLoop::Update update;
  update.view = views_[started_++];
  const std::uint64_t revision = rendering_->loop().update(update);
  if (started_ == views_.size()) rendering_->publisher().finish_after(revision);
}

void Job::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  rendering_->loop().cancel();
}

void Job::cancel() {
  stop();
  rendering_->publisher().finish_cancelled(grpc::Status::OK, /*tell=*/true);
}

Result<std::string> JobStore::reserve(const std::string& owner) {
  const std::lock_guard lock(mutex_);
  if (jobs_.size() >= std::size_t(max_jobs_)) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_jobs: {} jobs are running, as many as are allowed", jobs_.size()),
                 {},
                 kRetrySeconds};
  }
  std::string id = make_id("j-");
  jobs_.emplace(id, Place{owner, nullptr});
  return id;
}

std::optional<std::string> JobStore::owner_of(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? std::nullopt : std::optional(found->second.owner);
}

std::uint64_t JobStore::held_by(const std::string& owner) const {
  const std::lock_guard lock(mutex_);
  return std::uint64_t(
      std::count_if(jobs_.begin(), jobs_.end(), [&](const auto& j) { return j.second.owner == owner; }));
}

void JobStore::add(std::shared_ptr<Job> job) {
  const std::lock_guard lock(mutex_);
  jobs_[job->id()].job = job;
}

void JobStore::remove(const std::string& id) {
  std::shared_ptr<Job> removed;  // destroyed outside the lock
  std::function<void()> told;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return;
    removed = std::move(found->second.job);
    jobs_.erase(found);
    removed_.notify_all();
    told = told_;
  }
  if (told) told();
}

void JobStore::on_removed(std::function<void()> told) {
  const std::lock_guard lock(mutex_);
  told_ = std::move(told);
}

Status JobStore::cancel(const std::string& id, const std::string& where) {
  std::shared_ptr<Job> job;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found != jobs_.end()) job = found->second.job;
  }
  if (!job) return Error{ErrorCode::not_found, "there is no job '" + id + "'", where};
  job->cancel();
  return ok_status();
}

void JobStore::cancel_all() {
  std::vector<std::shared_ptr<Job>> jobs;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, place] : jobs_) {
      if (place.job) jobs.push_back(place.job);
    }
  }
  for (const auto& job : jobs) job->cancel();
}

std::size_t JobStore::of_calls() {
  const std::lock_guard lock(mutex_);
  return std::size_t(
      std::count_if(jobs_.begin(), jobs_.end(), [](const auto& entry) { return entry.second.job != nullptr; }));
}

bool JobStore::wait_until_empty(double deadline_s) {
  std::unique_lock lock(mutex_);
  const auto left = std::chrono::duration<double>(deadline_s - now_s());
  return removed_.wait_for(lock, left, [this] { return jobs_.empty(); });
}

}  // namespace helio
