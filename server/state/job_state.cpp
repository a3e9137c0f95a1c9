#include "server/state/job_state.h"

#include "renderer/base/check.h"

namespace helio {

const char* to_string(JobState state) {
  switch (state) {
    case JobState::queued:
      return "QUEUED";
    case JobState::running:
      return "RUNNING";
    case JobState::paused:
      return "PAUSED";
    case JobState::succeeded:
      return "SUCCEEDED";
    case JobState::failed:
      return "FAILED";
    case JobState::canceled:
      return "CANCELED";
  }
  HELIO_CHECK(false);
  return "";
}

const char* to_word(JobState state) {
  switch (state) {
    case JobState::queued:
      return "queued";
    case JobState::running:
      return "running";
    case JobState::paused:
      return "paused";
    case JobState::succeeded:
      return "succeeded";
    case JobState::failed:
      return "failed";
    case JobState::canceled:
      return "canceled";
  }
  HELIO_CHECK(false);
  return "";
}

bool is_final(JobState state) {
  return state == JobState::succeeded || state == JobState::failed || state == JobState::canceled;
}

bool may_follow(JobState from, JobState to) {
  using enum JobState;
  switch (from) {
    case queued:
      return to == running || to == paused || to == failed || to == canceled;
    case running:
      return to != running;
    case paused:
      return to == queued || to == failed || to == canceled;
    case succeeded:
    case failed:
    case canceled:
      return false;
  }
  return false;
}

}  // namespace helio
