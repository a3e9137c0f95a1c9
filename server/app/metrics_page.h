// What /metrics tells. server/README.md has the table of its metrics.
#pragma once

#include <string>

#include "server/compare/compare_core.h"
#include "server/jobs/durable_jobs.h"
#include "server/metrics/rpc_counts.h"

namespace helio {

class MetricsPage {
 public:
  // jobs: null: none are kept. All of them outlive it.
  MetricsPage(CompareCore& compare, const DurableJobs* jobs, const RpcCounts& calls);

  // The text format of Prometheus, version 0.0.4. Thread safe; may wait for the disk.
  std::string text() const;

 private:
  CompareCore& compare_;
  const DurableJobs* const jobs_;
  const RpcCounts& calls_;
  const double started_s_;  // Unix time
};

}  // namespace helio
