#include "server/jobs/job_messages.h"

#include <spdlog/fmt/fmt.h>

namespace helio {

pb::JobState to_message(JobState state) {
  return pb::JobState(state);
}

static_assert(int(JobState::queued) == pb::JOB_STATE_QUEUED && int(JobState::running) == pb::JOB_STATE_RUNNING &&
              int(JobState::paused) == pb::JOB_STATE_PAUSED && int(JobState::succeeded) == pb::JOB_STATE_SUCCEEDED &&
              int(JobState::failed) == pb::JOB_STATE_FAILED && int(JobState::canceled) == pb::JOB_STATE_CANCELED);

std::optional<JobState> read_job_state(pb::JobState state, const std::string& where, Problems& problems) {
  for (const JobState known : kJobStates) {
    if (to_message(known) == state) return known;
  }
  problems.add(where, fmt::format("{}; allowed: [1, {}], the numbers of JobState", int(state), kJobStates.size()));
  return std::nullopt;
}

pb::Job to_message(const JobRecord& record) {
  pb::SubmitJobRequest request;
  request.ParseFromString(record.summary);
  pb::Job job;
  job.set_job_id(record.id);
  job.set_name(record.name);
  job.set_scene_id(record.scene_id);
  *job.mutable_settings() = request.job().settings();
  *job.mutable_budget() = request.job().budget();
  if (request.has_output()) *job.mutable_output() = request.output();
  job.set_priority(record.priority);
  job.set_state(to_message(record.state));
  job.set_target_state(to_message(is_final(record.state) ? record.state : record.target));
  job.set_reason(record.reason);
  job.set_attempt(record.attempt);
  job.set_updated_seq(record.updated_seq);
  job.set_submitted_s(record.submitted_s);
  job.set_started_s(record.started_s);
  job.set_ended_s(record.ended_s);
  job.set_views(record.views);
  job.set_views_done(record.views_done);
  job.set_same_bits(record.same_bits);
  job.set_owner(record.owner);
  job.set_require_same_bits(request.require_same_bits());
  return job;
}

pb::JobEvent to_message(const JobEvent& event) {
  pb::JobEvent message;
  message.set_seq(event.seq);
  message.set_job_id(event.job_id);
  if (event.from) message.set_from(to_message(*event.from));
  message.set_to(to_message(event.to));
  message.set_reason(event.reason);
  message.set_by(event.by);
  message.set_attempt(event.attempt);
  message.set_time_s(event.time_s);
  return message;
}

pb::JobView to_message(const JobResult& result, bool with_file) {
  pb::JobView view;
  view.set_view(result.view);
  view.mutable_end()->ParseFromString(result.frame_end);
  if (with_file) view.set_file(result.file);
  view.set_bytes(result.bytes);
  view.set_sha256(result.sha256);
  return view;
}

}  // namespace helio
