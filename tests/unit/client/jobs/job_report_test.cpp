#include "client/cli/jobs/job_report.h"

#include <gtest/gtest.h>

namespace helio::test {
namespace {

using namespace helio::cli;
namespace pb = heliograph::v1;

pb::Job running() {
  pb::Job job;
  job.set_job_id("j-0123456789abcdef01234567");
  job.set_name("room");
  job.set_state(pb::JOB_STATE_RUNNING);
  job.set_target_state(pb::JOB_STATE_SUCCEEDED);
  job.set_views(1);
  job.set_priority(-3);
  job.set_attempt(2);
  job.set_submitted_s(1000);
  job.set_same_bits(true);
  job.mutable_settings()->set_width(64);
  job.mutable_budget()->set_samples(100);
  job.mutable_progress()->set_budget_used(0.429);
  job.mutable_progress()->set_samples_per_pixel(42);
  job.mutable_progress()->set_samples_per_second(2.5e6);
  job.mutable_left()->set_seconds(130);
  job.mutable_left()->set_low_s(100);
  job.mutable_left()->set_high_s(185);
  return job;
}

TEST(JobReport, TellsTimeLeftWithItsInterval) {
  EXPECT_EQ(describe_progress(running()),
            "running, 42 %, 42 samples, 2.5 M samples/s, 2 min 10 s (1 min 40 s to 3 min 05 s) left");
  pb::Job unknown = running();
  unknown.clear_left();
  EXPECT_EQ(left_text(unknown), "");
  EXPECT_EQ(describe_progress(unknown), "running, 42 %, 42 samples, 2.5 M samples/s");
}

// The daemon tells progress of what it renders, or has rendered since it began.
TEST(JobReport, AShareThatIsNotKnownIsNotShown) {
  pb::Job paused = running();
  paused.set_state(pb::JOB_STATE_PAUSED);
  paused.clear_progress();
  EXPECT_EQ(describe_progress(paused), "paused");
  EXPECT_EQ(live_table({paused}, 1125, 0)[1].find('['), std::string::npos);
  pb::Job queued = paused;
  queued.set_state(pb::JOB_STATE_QUEUED);
  queued.set_attempt(0);
  EXPECT_EQ(describe_progress(queued), "queued, 0 %");
}

TEST(JobReport, JsonHasWhatScriptsRead) {
  const Json json = to_json(running());
  EXPECT_EQ(json["job_id"], "j-0123456789abcdef01234567");
  EXPECT_EQ(json["state"], "running");
  EXPECT_EQ(json["target_state"], "succeeded");
  EXPECT_EQ(json["done"], 0.429);
  EXPECT_EQ(json["left_s"]["low"], 100);
  EXPECT_EQ(json["started_s"], nullptr);
  EXPECT_EQ(json["settings"]["width"], 64);
  EXPECT_EQ(json["budget"]["samples"], 100);
  EXPECT_EQ(json["results"], Json::array());
}

TEST(JobReport, TablesAreAlignedAndCutToTheTerminal) {
  pb::Job failed = running();
  failed.set_job_id("j-0123456789ffffff01234567");
  failed.set_name("a very long name that nobody wants to read whole");
  failed.set_state(pb::JOB_STATE_FAILED);
  failed.set_target_state(pb::JOB_STATE_FAILED);
  failed.set_reason("the scene\nis gone");
  const auto table = job_table({running(), failed}, 1000 + 125, 0);
  ASSERT_EQ(table.size(), 3u);
  EXPECT_EQ(table[0], "JOB            NAME                      STATE    DONE  PRIORITY  AGE    REASON");
  EXPECT_EQ(table[1], "j-0123456789a  room                      running  42 %  -3        2 min");
  EXPECT_EQ(table[2], "j-0123456789f  a very long name that...  failed   42 %  -3        2 min  the scene is gone");
  for (const std::string& line : job_table({running(), failed}, 1125, 60)) EXPECT_LE(line.size(), 60u);
  EXPECT_TRUE(job_table({running(), failed}, 1125, 60)[2].ends_with("..."));
  const auto live = live_table({running()}, 1125, 0);
  EXPECT_NE(live[1].find("[####------] 42 %"), std::string::npos) << live[1];
  EXPECT_NE(live[1].find("2 min 10 s (1 min 40 s to 3 min 05 s)"), std::string::npos) << live[1];
}

TEST(JobReport, AJobThatWasAskedToStopSaysSo) {
  pb::Job job = running();
  job.set_target_state(pb::JOB_STATE_PAUSED);
  EXPECT_NE(job_table({job}, 1125, 0)[1].find("will be paused"), std::string::npos);
}

TEST(JobReport, IdsAreAsShortAsTheyTellJobsApart) {
  std::vector<pb::Job> jobs(3);
  jobs[0].set_job_id("j-aaaaaaaaaaaaaa");
  jobs[1].set_job_id("j-bbbbbbbbbbbbbb");
  jobs[2].set_job_id("j-cccccccccccccc");
  EXPECT_EQ(short_ids(jobs)[0], "j-aaaaaaaa");
  jobs[2].set_job_id("j-bbbbbbbbbbbbxx");
  EXPECT_EQ(short_ids(jobs)[2], "j-bbbbbbbbbbbbx");
}

TEST(JobReport, TextIsCutBetweenCharacters) {
  EXPECT_EQ(fit("short", 5), "short");
  EXPECT_EQ(fit("longer", 5), "lo...");
  EXPECT_EQ(fit("äöüßxy", 6), "äöüßxy");
  EXPECT_EQ(fit("äöüßxy", 5), "äö...");
  EXPECT_EQ(fit("a\033[2Jb", 9), "a [2Jb");
  EXPECT_EQ(bar(0, 4), "[----]");
  EXPECT_EQ(bar(0.5, 4), "[##--]");
  EXPECT_EQ(bar(7, 4), "[####]");
}

TEST(JobReport, EventsSayWhoAskedAndWhy) {
  pb::JobEvent event;
  event.set_to(pb::JOB_STATE_QUEUED);
  EXPECT_EQ(describe(event), "submitted, queued");
  event.set_from(pb::JOB_STATE_QUEUED);
  event.set_to(pb::JOB_STATE_RUNNING);
  event.set_attempt(2);
  EXPECT_EQ(describe(event), "queued -> running (attempt 2)");
  event.set_from(pb::JOB_STATE_RUNNING);
  event.set_to(pb::JOB_STATE_PAUSED);
  event.set_reason("the disk is full");
  event.set_by("anna");
  EXPECT_EQ(describe(event), "running -> paused: the disk is full, by anna");
}

}  // namespace
}  // namespace helio::test
