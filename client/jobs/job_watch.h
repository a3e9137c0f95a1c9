// Watches a job to its end, over restarts of the daemon.
#pragma once

#include <functional>
#include <string>

#include "client/jobs/job_client.h"

namespace helio {

class JobWatch {
 public:
  // `wait_s`: how long a daemon that is gone is waited for, each time; 0: not.
  JobWatch(JobClient& jobs, std::string job_id, double wait_s)
      : jobs_(jobs), job_id_(std::move(job_id)), wait_s_(wait_s) {}

  // Blocks. Every event comes once, also those of the time without a connection, as far as the daemon keeps them;
  // `watching` comes once. `lost` is called when the daemon goes away and will be waited for. Errors: cancelled,
  // unavailable, those of JobClient.
  Status run(const JobWatchCallbacks& callbacks, CallControl& control,
             const std::function<void(const Error&)>& lost = {});

 private:
  JobClient& jobs_;
  const std::string job_id_;
  const double wait_s_;
};

}  // namespace helio
