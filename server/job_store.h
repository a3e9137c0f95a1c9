// The jobs in hand. A job lives as long as its call.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/rendering.h"

namespace helio {

struct Job {
  std::string id;
  std::shared_ptr<Rendering> rendering;

  // Its stream ends with its result, reason CANCELLED.
  void cancel();
};

class JobStore {
 public:
  explicit JobStore(int max_jobs) : max_jobs_(max_jobs) {}

  // A place for a job, kept until remove(). resource_exhausted: max_jobs.
  Result<std::string> reserve();
  void add(std::shared_ptr<Job> job);  // its id was given by reserve()
  void remove(const std::string& id);

  // The job's stream ends with its result, reason CANCELLED. not_found.
  Status cancel(const std::string& id, const std::string& where);
  void cancel_all();
  // False when jobs are left at that time (now_s() clock).
  bool wait_until_empty(double deadline_s);

 private:
  const int max_jobs_;
  std::mutex mutex_;
  std::condition_variable removed_;
  std::map<std::string, std::shared_ptr<Job>> jobs_;  // null: reserved
};

}  // namespace helio
