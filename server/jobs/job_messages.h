// Rows of the job table <-> messages of durable_job.proto.
#pragma once

#include <optional>
#include <string>

#include "heliograph/v1/durable_job.pb.h"
#include "renderer/base/result.h"
#include "server/state/job_table.h"

namespace helio {

namespace pb = heliograph::v1;

pb::JobState to_message(JobState state);
// Nothing, and a problem: unspecified, or a number that this daemon does not know.
std::optional<JobState> read_job_state(pb::JobState state, const std::string& where, Problems& problems);
// Without progress and results.
pb::Job to_message(const JobRecord& record);
pb::JobEvent to_message(const JobEvent& event);
// with_file: where it lies is the caller's own business.
pb::JobView to_message(const JobResult& result, bool with_file);

}  // namespace helio
