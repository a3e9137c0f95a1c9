// The jobs in hand. A job lives as long as its call at most.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/sessions/render_context.h"

namespace helio {

class Job {
 public:
  // The views' ids count from 1. At least one.
  Job(std::string id, std::shared_ptr<RenderContext> rendering, std::vector<View> views)
      : id_(std::move(id)), rendering_(std::move(rendering)), views_(std::move(views)) {}

  const std::string& id() const { return id_; }
  RenderContext& rendering() { return *rendering_; }
  const std::vector<View>& views() const { return views_; }

  // Renders the next view; nothing after stop(). Precondition: the one before has ended, and one is left.
  void start_view();
  // Ends the view in hand; no further one starts.
  void stop();
  // stop(), and the stream ends with the job's result, reason CANCELLED.
  void cancel();
  bool stopped() const { return stopped_; }

 private:
  const std::string id_;
  const std::shared_ptr<RenderContext> rendering_;
  const std::vector<View> views_;

  std::mutex mutex_;  // a view starts before the stop, or not at all
  std::size_t started_ = 0;
  std::atomic<bool> stopped_ = false;
};

class JobStore {
 public:
  explicit JobStore(int max_jobs) : max_jobs_(max_jobs) {}

  // A place for a job, kept until remove(). owner: name of the token of whoever asked for it; empty: nobody in
  // particular, as for jobs that the daemon keeps, which know their owners. resource_exhausted: max_jobs.
  Result<std::string> reserve(const std::string& owner = {});
  std::optional<std::string> owner_of(const std::string& id) const;  // nothing: there is no such job
  std::uint64_t held_by(const std::string& owner) const;
  void add(std::shared_ptr<Job> job);  // its id was given by reserve()
  void remove(const std::string& id);
  // `told` is called after each remove(), without the store's lock; empty: nobody is.
  void on_removed(std::function<void()> told);

  // The job's stream ends with its result, reason CANCELLED. not_found.
  Status cancel(const std::string& id, const std::string& where);
  void cancel_all();
  // Jobs that live as long as their calls.
  std::size_t of_calls();
  // False when jobs are left at that time (now_s() clock).
  bool wait_until_empty(double deadline_s);

 private:
  struct Place {
    std::string owner;
    std::shared_ptr<Job> job;  // null: reserved
  };

  const int max_jobs_;
  mutable std::mutex mutex_;
  std::condition_variable removed_;
  std::function<void()> told_;
  std::map<std::string, Place> jobs_;
};

}  // namespace helio
