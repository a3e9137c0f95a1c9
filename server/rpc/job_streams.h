// The streams about jobs that the daemon keeps: WatchJob, GetResult, and RunJob with `detach`.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <string>

#include "heliograph/v1/durable_job.pb.h"
#include "server/jobs/durable_jobs.h"
#include "server/rpc/pulled_stream.h"

namespace helio {

// What each rpc sends. `by`: who asks.
PulledStream::Make watch_job(ServiceCore& core, DurableJobs& jobs, pb::WatchJobRequest request);
PulledStream::Make get_result(ServiceCore& core, DurableJobs& jobs, pb::GetResultRequest request, CallerPtr caller);
PulledStream::Make run_detached_job(ServiceCore& core, DurableJobs& jobs, pb::RunJobRequest request, CallerPtr caller,
                                    std::string by);

}  // namespace helio
