// The states of a durable job and the ways between them: the one state machine of all that changes a job.
#pragma once

#include <array>

namespace helio {

// Their numbers are stored.
enum class JobState {
  queued = 1,  // waits for its turn
  running,
  paused,  // by a call, or because it cannot go on: the reason says why
  succeeded,
  failed,
  canceled,
};
inline constexpr std::array kJobStates = {JobState::queued,    JobState::running, JobState::paused,
                                          JobState::succeeded, JobState::failed,  JobState::canceled};

// "QUEUED", as the protocol spells it.
const char* to_string(JobState state);
const char* to_word(JobState state);  // "queued", as logs and metrics do
// Nothing follows.
bool is_final(JobState state);
// queued -> running, paused, failed, canceled; running -> queued (the daemon stopped), paused, succeeded, failed,
// canceled; paused -> queued, canceled, failed.
bool may_follow(JobState from, JobState to);

}  // namespace helio
