#include "server/state/job_state.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>

namespace helio {
namespace {

using enum JobState;

// The state machine of the protocol, pair by pair.
TEST(JobState, WhatMayFollow) {
  const std::set<std::pair<JobState, JobState>> allowed = {
      {queued, running},    {queued, paused},  {queued, failed},    {queued, canceled},
      {running, queued},    {running, paused}, {running, succeeded}, {running, failed},
      {running, canceled},  {paused, queued},  {paused, canceled},  {paused, failed},
  };
  for (const JobState from : kJobStates) {
    for (const JobState to : kJobStates) {
      EXPECT_EQ(may_follow(from, to), allowed.contains({from, to})) << to_string(from) << " -> " << to_string(to);
    }
  }
}

TEST(JobState, NothingFollowsTheEnds) {
  for (const JobState from : kJobStates) {
    bool any = false;
    for (const JobState to : kJobStates) any |= may_follow(from, to);
    EXPECT_EQ(is_final(from), !any) << to_string(from);
  }
}

TEST(JobState, NamesAreThoseOfTheProtocol) {
  std::string names;
  for (const JobState state : kJobStates) names += std::string(to_string(state)) + " ";
  EXPECT_EQ(names, "QUEUED RUNNING PAUSED SUCCEEDED FAILED CANCELED ");
}

}  // namespace
}  // namespace helio
