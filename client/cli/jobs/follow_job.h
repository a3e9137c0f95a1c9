// --watch: a job is followed to its end, on the terminal.
#pragma once

#include <string>
#include <variant>

#include "client/cli/command_context.h"
#include "client/cli/interrupt.h"
#include "client/cli/terminal.h"
#include "client/jobs/job_client.h"

namespace helio::cli {

// Prints each change of state until the job has succeeded, over restarts of the daemon with --wait, and answers it with
// its results. An exit code: it has come to another end, was interrupted or cannot be followed, and that has been said,
// with `json` as the result of the command and what is known of the job in it.
std::variant<heliograph::v1::Job, int> follow_to_end(JobClient& jobs, const std::string& id, CommandContext& context,
                                                     const Interrupt& interrupt, CallControl& control, Json json);

}  // namespace helio::cli
