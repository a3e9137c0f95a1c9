#include "client/jobs/job_board.h"

#include <gtest/gtest.h>

namespace helio::test {
namespace {

namespace pb = heliograph::v1;

pb::Job job(const std::string& id, pb::JobState state, std::uint64_t seq = 1) {
  pb::Job made;
  made.set_job_id(id);
  made.set_state(state);
  made.set_updated_seq(seq);
  made.set_views(1);
  return made;
}

pb::JobEvent event(const std::string& id, std::uint64_t seq, pb::JobState to) {
  pb::JobEvent made;
  made.set_job_id(id);
  made.set_seq(seq);
  made.set_to(to);
  made.set_time_s(double(seq));
  return made;
}

std::string order(const JobBoard& board, std::size_t most_over = 10) {
  std::string ids;
  for (const pb::Job& one : board.rows(most_over)) ids += one.job_id();
  return ids;
}

TEST(JobBoard, RunningFirstThenTheQueueInTheOrderOfItsTurns) {
  JobBoard board;
  const auto add = [&](const std::string& id, pb::JobState state, int priority, double submitted, double started,
                       double ended) {
    pb::Job one = job(id, state);
    one.set_priority(priority);
    one.set_submitted_s(submitted);
    one.set_started_s(started);
    one.set_ended_s(ended);
    board.take(one);
  };
  add("a", pb::JOB_STATE_SUCCEEDED, 0, 1, 2, 3);
  add("b", pb::JOB_STATE_FAILED, 0, 1, 2, 4);
  add("c", pb::JOB_STATE_QUEUED, 0, 6, 0, 0);
  add("d", pb::JOB_STATE_QUEUED, 0, 5, 0, 0);
  add("e", pb::JOB_STATE_QUEUED, 9, 7, 0, 0);
  add("f", pb::JOB_STATE_PAUSED, 99, 1, 2, 0);
  add("g", pb::JOB_STATE_RUNNING, 0, 1, 9, 0);
  add("h", pb::JOB_STATE_RUNNING, 50, 1, 10, 0);
  EXPECT_EQ(order(board), "ghedcfba");
  EXPECT_EQ(order(board, 1), "ghedcfb");
  EXPECT_EQ(order(board, 0), "ghedcf");
  EXPECT_EQ(board.count(pb::JOB_STATE_QUEUED), 3u);
}

TEST(JobBoard, ForgetsJobsThatAreOverButForTheNewest) {
  JobBoard board;
  for (int i = 0; i < 9; ++i) {
    pb::Job one = job(std::string(1, char('a' + i)), i < 6 ? pb::JOB_STATE_SUCCEEDED : pb::JOB_STATE_QUEUED);
    one.set_ended_s(i);
    board.take(one);
  }
  board.forget_over(2);
  EXPECT_EQ(order(board), "ghife");
  board.forget_over(2);
  EXPECT_EQ(board.count(pb::JOB_STATE_SUCCEEDED), 2u);
  board.forget_over(0);
  EXPECT_EQ(order(board), "ghi");
}

TEST(JobBoard, TheNewestWordCountsWhateverCameLast) {
  JobBoard board;
  EXPECT_FALSE(board.take(event("a", 1, pb::JOB_STATE_QUEUED)));  // has to be asked for
  board.take(job("a", pb::JOB_STATE_QUEUED, 1));
  EXPECT_TRUE(board.take(event("a", 5, pb::JOB_STATE_RUNNING)));
  board.take(job("a", pb::JOB_STATE_QUEUED, 4));  // a list that was on its way
  EXPECT_EQ(board.rows(9).front().state(), pb::JOB_STATE_RUNNING);
  EXPECT_EQ(board.rows(9).front().started_s(), 5);
  EXPECT_TRUE(board.take(event("a", 4, pb::JOB_STATE_PAUSED)));  // so was this
  EXPECT_EQ(board.rows(9).front().state(), pb::JOB_STATE_RUNNING);

  pb::Job running = job("a", pb::JOB_STATE_RUNNING, 5);
  running.mutable_progress()->set_budget_used(0.5);
  running.mutable_left()->set_seconds(10);
  board.take(running);
  EXPECT_EQ(board.rows(9).front().left().seconds(), 10);
  EXPECT_TRUE(board.take(event("a", 6, pb::JOB_STATE_SUCCEEDED)));
  const pb::Job over = board.rows(9).front();
  EXPECT_FALSE(over.has_left());
  EXPECT_EQ(over.ended_s(), 6);
  EXPECT_EQ(done_share(over), 1);
}

TEST(JobBoard, TheShareThatIsDoneCountsWholeViewsAndTheOneInHand) {
  pb::Job one = job("a", pb::JOB_STATE_RUNNING);
  EXPECT_EQ(done_share(one), 0);
  one.set_views(4);
  one.set_views_done(1);
  EXPECT_EQ(done_share(one), 0.25);
  one.mutable_progress()->set_budget_used(0.5);
  EXPECT_EQ(done_share(one), 0.375);  // (1 + 0.5) / 4
  one.set_views_done(4);
  EXPECT_EQ(done_share(one), 1);  // the last view's progress does not count twice
}

}  // namespace
}  // namespace helio::test
