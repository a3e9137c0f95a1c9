#include "client/cli/jobs/follow_job.h"

#include <spdlog/fmt/fmt.h>

#include "client/cli/exit_code.h"
#include "client/cli/jobs/job_report.h"
#include "client/jobs/job_watch.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

// Blocks until the job is over.
Status follow(JobClient& jobs, const std::string& id, CommandContext& context, CallControl& control) {
  Terminal& terminal = context.terminal;
  const double wait_s = context.connection.connect.retry ? context.connection.connect.timeout_s : 0;
  JobWatch watch(jobs, id, wait_s);
  const auto say_how_to_resume = [&](pb::JobState state) {
    if (state == pb::JOB_STATE_PAUSED)
      terminal.say("  it waits until: heliograph job " + id + " --resume" + context.connection.flags);
  };
  JobWatchCallbacks callbacks;
  callbacks.watching = [&](const pb::WatchJobResponse::Watching& now) {
    terminal.say("job " + id + ": " + describe_progress(now.job()) +
                 (now.job().reason().empty() ? "" : ": " + single_line(now.job().reason())));
    say_how_to_resume(now.job().state());
  };
  callbacks.event = [&](const pb::JobEvent& event) {
    terminal.say(describe(event));
    say_how_to_resume(event.to());
  };
  callbacks.progress = [&](const pb::Job& job) { terminal.progress(describe_progress(job)); };
  const Status over =
      watch.run(callbacks, control, [&](const Error& error) { terminal.warn(error.to_string() + "; waiting for it"); });
  terminal.end_progress();
  return over;
}

}  // namespace

std::variant<pb::Job, int> follow_to_end(JobClient& jobs, const std::string& id, CommandContext& context,
                                         const Interrupt& interrupt, CallControl& control, Json json) {
  Terminal& terminal = context.terminal;
  const Status over = follow(jobs, id, context, control);
  if (interrupt.raised()) {
    return terminal.fail(interrupt.exit_code(),
                         fmt::format("interrupted; job {} goes on: heliograph job {} --watch{} follows it again", id, id,
                                     context.connection.flags),
                         json);
  }
  if (!over) return context.fail(over.error());
  const auto job = jobs.get(id);
  if (!job) return context.fail(job.error());
  if (job->state() == pb::JOB_STATE_SUCCEEDED) return *job;
  json.update(to_json(*job));
  return terminal.fail(
      kFailed,
      fmt::format("the job {} {}{}", job->state() == pb::JOB_STATE_FAILED ? "has" : "was", state_name(job->state()),
                  job->reason().empty() ? "" : ": " + single_line(job->reason())),
      json);
}

}  // namespace helio::cli
