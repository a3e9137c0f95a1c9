#include "server/state/job_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <thread>

#include "server/state/sqlite_database.h"
#include "state_process.h"

namespace helio::test {
namespace {

using enum JobState;

constexpr int kMany = 1 << 20;

class JobTableTest : public testing::Test {
 protected:
  JobTableTest() { open(); }

  void open() {
    table_.reset();
    std::vector<std::string> notices;
    auto table = JobTable::open(folder_ / "jobs.sqlite", notices);
    ASSERT_TRUE(table) << table.error().to_string();
    EXPECT_EQ(notices, std::vector<std::string>());
    table_ = std::move(*table);
  }

  JobRecord submit(const std::string& id, int priority = 0) {
    JobRecord job = make_job(id);
    job.priority = priority;
    auto submitted = table_->submit(job, kMany, "tester");
    EXPECT_TRUE(submitted) << submitted.error().to_string();
    return submitted ? submitted->job : job;
  }
  JobRecord change(const std::string& id, JobState to) {
    auto changed = table_->change(id, {to});
    EXPECT_TRUE(changed) << changed.error().to_string();
    return changed ? *changed : JobRecord();
  }
  // A job in this state, by the shortest way.
  void bring(const std::string& id, JobState state) {
    submit(id);
    if (state == paused) change(id, paused);
    if (state == running || is_final(state)) change(id, running);
    if (is_final(state)) change(id, state);
  }
  std::vector<std::string> ids(const JobTable::Page& page) {
    std::vector<std::string> ids;
    for (const JobRecord& job : page.jobs) ids.push_back(job.id);
    return ids;
  }

  TemporaryFolder folder_;
  std::unique_ptr<JobTable> table_;
};

void expect_error(const Error& error, ErrorCode code, std::initializer_list<const char*> parts) {
  EXPECT_EQ(int(error.code), int(code)) << error.to_string();
  for (const char* part : parts) EXPECT_NE(error.to_string().find(part), std::string::npos) << error.to_string();
}

TEST_F(JobTableTest, ASubmittedJobIsThereAfterReopening) {
  JobRecord job = make_job("one");
  job.client_token = "token";
  job.priority = -3;
  job.views = 5;
  job.submitted_s = 1234.5;
  ASSERT_TRUE(table_->submit(job, kMany, "tester"));
  open();
  const auto found = table_->get("one");
  ASSERT_TRUE(found) << found.error().to_string();
  EXPECT_EQ(found->owner, "owner");
  EXPECT_EQ(found->client_token, "token");
  EXPECT_EQ(found->name, "name of one");
  EXPECT_EQ(found->summary, std::string("request\0of one", 14));
  EXPECT_EQ(*table_->request("one"), std::string("request\0of one", 14));
  EXPECT_EQ(found->scene_id, "scene");
  EXPECT_EQ(found->priority, -3);
  EXPECT_EQ(found->state, queued);
  EXPECT_EQ(found->target, succeeded);
  EXPECT_EQ(found->attempt, 0u);
  EXPECT_EQ(found->updated_seq, 1u);
  EXPECT_EQ(found->submitted_s, 1234.5);
  EXPECT_EQ(found->started_s, 0);
  EXPECT_EQ(found->ended_s, 0);
  EXPECT_EQ(found->views, 5u);
  EXPECT_EQ(found->views_done, 0u);
  EXPECT_TRUE(found->same_bits);
  const auto events = table_->events("one", 0, 10);
  ASSERT_TRUE(events && events->size() == 1);
  EXPECT_FALSE(events->front().from);
  EXPECT_EQ(events->front().to, queued);
  EXPECT_EQ(events->front().by, "tester");
  EXPECT_EQ(events->front().time_s, 1234.5);
}

TEST_F(JobTableTest, UnknownJobsAreNotFound) {
  expect_error(table_->get("x").error(), ErrorCode::not_found, {"job_id", "'x'"});
  expect_error(table_->results("x").error(), ErrorCode::not_found, {"'x'"});
  expect_error(table_->change("x", {running}).error(), ErrorCode::not_found, {"'x'"});
  expect_error(table_->set_target("x", paused, "").error(), ErrorCode::not_found, {"'x'"});
  expect_error(table_->set_priority("x", 1).error(), ErrorCode::not_found, {"'x'"});
  expect_error(table_->add_result("x", {}).error(), ErrorCode::not_found, {"'x'"});
  EXPECT_TRUE(table_->events("x", 0, 10)->empty());
}

TEST_F(JobTableTest, IdsAreUniqueAndNotEmpty) {
  submit("one");
  expect_error(table_->submit(make_job("one"), kMany, "tester").error(), ErrorCode::invalid_argument,
               {"job_id", "'one'", "taken"});
  expect_error(table_->submit(make_job(""), kMany, "tester").error(), ErrorCode::invalid_argument, {"job_id", "empty"});
  EXPECT_EQ(table_->events("", 0, 10)->size(), 1u);
}

// Every pair of states: the change is made and has its event, or is refused and leaves no trace.
TEST_F(JobTableTest, ChangesFollowTheStateMachine) {
  for (const JobState from : kJobStates) {
    for (const JobState to : kJobStates) {
      const std::string id = std::string(to_string(from)) + "-" + to_string(to);
      bring(id, from);
      const JobRecord before = *table_->get(id);
      const auto changed = table_->change(id, {.to = to, .reason = "why", .by = "who"});
      const auto events = table_->events(id, before.updated_seq + 1, 10);
      ASSERT_TRUE(events);
      if (!may_follow(from, to)) {
        ASSERT_FALSE(changed) << id;
        expect_error(changed.error(), ErrorCode::failed_precondition, {"job_id", to_string(from), to_string(to)});
        EXPECT_TRUE(events->empty()) << id;
        EXPECT_EQ(table_->get(id)->state, from) << id;
        continue;
      }
      ASSERT_TRUE(changed) << changed.error().to_string();
      EXPECT_EQ(changed->state, to) << id;
      EXPECT_EQ(changed->reason, "why") << id;
      EXPECT_EQ(changed->attempt, before.attempt + (to == running)) << id;
      EXPECT_EQ(changed->started_s > 0, before.started_s > 0 || to == running) << id;
      EXPECT_EQ(changed->ended_s > 0, is_final(to)) << id;
      ASSERT_EQ(events->size(), 1u) << id;
      EXPECT_EQ(events->front().seq, changed->updated_seq) << id;
      EXPECT_EQ(events->front().from, from) << id;
      EXPECT_EQ(events->front().to, to) << id;
      EXPECT_EQ(events->front().reason, "why") << id;
      EXPECT_EQ(events->front().by, "who") << id;
      EXPECT_EQ(events->front().attempt, changed->attempt) << id;
      EXPECT_EQ(table_->get(id)->updated_seq, changed->updated_seq) << id;
    }
  }
}

TEST_F(JobTableTest, AChangeMayAskForTheStateThatItComesFrom) {
  bring("one", paused);
  const auto refused = table_->change("one", {.to = canceled, .from = {queued, running}});
  expect_error(refused.error(), ErrorCode::failed_precondition, {"'one'", "PAUSED", "QUEUED, RUNNING", "CANCELED"});
  EXPECT_TRUE(table_->change("one", {.to = canceled, .from = {queued, paused}}));
}

TEST_F(JobTableTest, AttemptsAreCounted) {
  submit("one");
  const double first = change("one", running).started_s;
  auto again = table_->change("one", {.to = queued, .reason = "the daemon stopped"});
  EXPECT_EQ(again->reason, "the daemon stopped");
  again = table_->change("one", {.to = running, .same_bits = false, .build = "build 2"});
  EXPECT_EQ(again->attempt, 2u);
  EXPECT_EQ(again->started_s, first);
  EXPECT_EQ(again->reason, "");
  open();
  EXPECT_FALSE(table_->get("one")->same_bits);
  EXPECT_EQ(table_->get("one")->build, "build 2");
  EXPECT_EQ(table_->events("one", 0, 10)->back().attempt, 2u);
}

// A pause that a crash interrupts is still known: who asked for it, too.
TEST_F(JobTableTest, ATargetIsKeptUntilTheNextChange) {
  submit("one");
  expect_error(table_->set_target("one", paused, "ann").error(), ErrorCode::failed_precondition, {"QUEUED", "RUNNING"});
  change("one", running);
  expect_error(table_->set_target("one", failed, "ann").error(), ErrorCode::invalid_argument,
               {"target", "FAILED", "PAUSED, CANCELED"});
  const std::uint64_t seq = table_->get("one")->updated_seq;
  ASSERT_TRUE(table_->set_target("one", paused, "ann"));
  open();
  EXPECT_EQ(table_->get("one")->target, paused);
  EXPECT_EQ(table_->get("one")->target_by, "ann");
  EXPECT_EQ(table_->get("one")->updated_seq, seq);
  change("one", paused);
  EXPECT_EQ(table_->get("one")->target, succeeded);
  EXPECT_EQ(table_->get("one")->target_by, "");
  EXPECT_EQ(table_->events("one", seq + 1, 10)->front().by, "ann");
  // Also where its attempt is sent back meanwhile.
  change("one", queued);
  change("one", running);
  ASSERT_TRUE(table_->set_target("one", paused, "ann"));
  EXPECT_EQ(change("one", queued).state, paused);
}

TEST_F(JobTableTest, ACancelThatWasAcceptedIsNotLostToAPause) {
  submit("one");
  change("one", running);
  ASSERT_TRUE(table_->set_target("one", canceled, "ann"));
  expect_error(table_->set_target("one", paused, "ben").error(), ErrorCode::failed_precondition, {"being cancelled"});
  EXPECT_EQ(table_->get("one")->target, canceled);
  EXPECT_EQ(change("one", queued).state, canceled) << "its attempt was sent back meanwhile";
}

// Who pauses and resumes for ever is stopped at a place where nothing hangs.
TEST_F(JobTableTest, AJobThatHasChangedTooOftenCanStillBePausedAndCancelled) {
  submit("one");
  change("one", running);
  {
    auto database = SqliteDatabase::open(folder_ / "jobs.sqlite", SqliteDatabase::Access::write);
    ASSERT_TRUE(database) << database.error().to_string();
    const Status added = (*database)->execute(
        "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 10000) INSERT INTO events (job, "
        "from_state, to_state, reason, asked_by, attempt, time_s) SELECT (SELECT number FROM jobs), 1, 2, '', '', 1, 0 "
        "FROM n");
    ASSERT_TRUE(added.ok()) << added.error().to_string();
  }
  ASSERT_TRUE(table_->set_target("one", paused, "ann"));
  const auto stopped = table_->change("one", {.to = paused, .by = "ann"});
  ASSERT_TRUE(stopped) << stopped.error().to_string();
  expect_error(table_->change("one", {.to = queued, .by = "ann"}).error(), ErrorCode::failed_precondition,
               {"10003 times", "allowed: 10000", "cancelled"});
  EXPECT_TRUE(table_->change("one", {.to = canceled, .by = "ann"}));
}

TEST_F(JobTableTest, ATokenMakesASubmissionIdempotent) {
  JobRecord job = make_job("one");
  job.client_token = "token";
  const auto first = table_->submit(job, kMany, "tester");
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->already_there);

  JobRecord repeated = job;
  repeated.id = "two";
  const auto second = table_->submit(repeated, 1, "tester");  // it needs no room
  ASSERT_TRUE(second) << second.error().to_string();
  EXPECT_TRUE(second->already_there);
  EXPECT_EQ(second->job.id, "one");
  EXPECT_FALSE(table_->get("two"));

  JobRecord other = repeated;
  other.request += "!";
  expect_error(table_->submit(other, kMany, "tester").error(), ErrorCode::invalid_argument,
               {"client_token", "'token'", "'one'"});

  JobRecord other_owner = other;
  other_owner.owner = "somebody else";
  EXPECT_FALSE(table_->submit(other_owner, kMany, "tester")->already_there);
  // Without a token everything is new.
  EXPECT_FALSE(table_->submit(make_job("three"), kMany, "tester")->already_there);
  EXPECT_FALSE(table_->submit(make_job("four"), kMany, "tester")->already_there);
}

TEST_F(JobTableTest, QueuedAndPausedJobsAreLimited) {
  bring("running", running);
  bring("done", succeeded);
  bring("paused", paused);
  submit("queued");
  expect_error(table_->submit(make_job("more"), 2, "tester").error(), ErrorCode::resource_exhausted,
               {"max_queued_jobs", "2 jobs", "allowed: 2"});
  EXPECT_FALSE(table_->get("more"));
  EXPECT_TRUE(table_->submit(make_job("more"), 3, "tester"));
}

TEST_F(JobTableTest, PrioritiesOrderTheQueue) {
  submit("low", -1);
  submit("first", 5);
  submit("second", 5);
  const auto next = [&](const std::vector<std::string>& except) {
    const auto job = table_->next_queued(except);
    return job && *job ? (*job)->id : std::string("none");
  };
  EXPECT_EQ(next({}), "first");
  EXPECT_EQ(next({"first"}), "second");
  EXPECT_EQ(next({"second", "first"}), "low");
  EXPECT_EQ(next({"second", "first", "low"}), "none");
  ASSERT_TRUE(table_->set_priority("low", 6));
  EXPECT_EQ(next({}), "low");
  change("low", running);
  EXPECT_EQ(next({}), "first");
  ASSERT_TRUE(table_->set_priority("low", 7));
  EXPECT_EQ(table_->get("low")->priority, 7);
  change("low", failed);
  expect_error(table_->set_priority("low", 7).error(), ErrorCode::failed_precondition, {"'low'", "FAILED"});
}

TEST_F(JobTableTest, ResultsCountViews) {
  JobRecord job = make_job("one");
  job.views = 3;
  ASSERT_TRUE(table_->submit(job, kMany, "tester"));
  expect_error(table_->add_result("one", {}).error(), ErrorCode::failed_precondition, {"QUEUED", "RUNNING"});
  change("one", running);
  ASSERT_TRUE(table_->add_result("one", {2, std::string("end\0!", 5), "/b.exr", 1ull << 40, "bb"}).ok());
  ASSERT_TRUE(table_->add_result("one", {0, "end", "/a.exr", 5, "aa"}).ok());
  ASSERT_TRUE(table_->add_result("one", {0, "end", "/c.exr", 6, "cc"}).ok());
  expect_error(table_->add_result("one", {3, "end", "/d.exr", 6, "cc"}).error(), ErrorCode::invalid_argument,
               {"view", "3", "[0, 3)"});
  EXPECT_EQ(table_->get("one")->views_done, 2u);
  const auto results = table_->results("one");
  ASSERT_TRUE(results && results->size() == 2);
  EXPECT_EQ((*results)[0].file, "/c.exr");
  EXPECT_EQ((*results)[0].sha256, "cc");
  EXPECT_EQ((*results)[1].view, 2u);
  EXPECT_EQ((*results)[1].frame_end, std::string("end\0!", 5));
  EXPECT_EQ((*results)[1].bytes, 1ull << 40);
}

// 25 jobs by pages of 10, newest first; jobs that come and go between two pages neither repeat nor hide others.
TEST_F(JobTableTest, ListsPages) {
  for (int i = 0; i < 25; ++i) submit("job" + std::to_string(i));
  auto page = table_->list({}, "", 10);
  ASSERT_TRUE(page);
  EXPECT_EQ(page->total, 25u);
  std::vector<std::string> seen = ids(*page);
  EXPECT_EQ(seen.front(), "job24");
  submit("later");
  change("job3", running);
  change("job3", failed);
  ASSERT_EQ(table_->forget_ended({4e9})->size(), 1u);
  while (!page->next.empty()) {
    page = table_->list({}, page->next, 10);
    ASSERT_TRUE(page);
    for (const std::string& id : ids(*page)) seen.push_back(id);
  }
  EXPECT_EQ(page->total, 25u);
  std::vector<std::string> expected;
  for (int i = 24; i >= 0; --i) {
    if (i != 3) expected.push_back("job" + std::to_string(i));
  }
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(table_->list({}, "", 25)->next, "");
  EXPECT_NE(table_->list({}, "", 24)->next, "");
}

TEST_F(JobTableTest, ListsByState) {
  for (const JobState state : kJobStates) {
    for (int i = 0; i <= int(state); ++i) bring(to_string(state) + std::to_string(i), state);
  }
  EXPECT_EQ(*table_->counts(), (std::vector<std::uint64_t>{0, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(ids(*table_->list({running}, "", 10)), (std::vector<std::string>{"RUNNING2", "RUNNING1", "RUNNING0"}));
  const auto page = table_->list({succeeded, queued}, "", 3);
  EXPECT_EQ(ids(*page), (std::vector<std::string>{"SUCCEEDED4", "SUCCEEDED3", "SUCCEEDED2"}));
  EXPECT_EQ(page->total, 7u);
  EXPECT_EQ(ids(*table_->list({queued, succeeded}, page->next, 3)),
            (std::vector<std::string>{"SUCCEEDED1", "SUCCEEDED0", "QUEUED1"}));
  const auto in_state = table_->in_state(paused);
  ASSERT_TRUE(in_state && in_state->size() == 4);
  EXPECT_EQ(in_state->front().id, "PAUSED0");

  for (const std::string token : {"x", "1", "1.", ".2", "1.2.3", "-1.7e", "99999999999999999.7e"}) {
    expect_error(table_->list({}, token, 3).error(), ErrorCode::invalid_argument, {"page_token", token.c_str()});
  }
  expect_error(table_->list({queued}, page->next, 3).error(), ErrorCode::invalid_argument,
               {"page_token", "same states"});
}

TEST_F(JobTableTest, EventsGoOnFromASequenceNumber) {
  submit("a");
  submit("b");
  change("a", running);
  change("b", canceled);
  change("a", succeeded);
  const auto all = table_->events("", 0, 100);
  ASSERT_TRUE(all && all->size() == 5);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ((*all)[i].seq, i + 1);
  EXPECT_EQ((*all)[3].job_id, "b");
  const auto some = table_->events("a", 2, 100);
  ASSERT_TRUE(some && some->size() == 2);
  EXPECT_EQ((*some)[0].seq, 3u);
  EXPECT_EQ((*some)[1].seq, 5u);
  EXPECT_EQ((*some)[1].from, running);
  EXPECT_EQ(table_->events("a", 3, 100)->front().seq, 3u) << "the number that is asked for is one of them";
  EXPECT_EQ(table_->events("", 2, 2)->back().seq, 3u);
  EXPECT_TRUE(table_->events("", 6, 100)->empty());
  EXPECT_TRUE(table_->events("", ~std::uint64_t(0), 100)->empty());
  // Numbers of jobs that are forgotten are not used again, which would hide events from who has seen those.
  ASSERT_EQ(table_->forget_ended({4e9})->size(), 2u);
  EXPECT_TRUE(table_->events("", 0, 100)->empty());
  open();
  submit("c");
  EXPECT_EQ(table_->events("", 0, 100)->front().seq, 6u);
}

TEST_F(JobTableTest, ForgetsWhatHasEnded) {
  bring("done", succeeded);
  bring("running", running);
  submit("queued");
  ASSERT_TRUE(table_->add_result("running", {0, "end", "/a.exr", 5, "aa"}).ok());
  EXPECT_TRUE(table_->forget_ended({table_->get("done")->ended_s})->empty());
  EXPECT_EQ(*table_->forget_ended({4e9}), std::vector<std::string>{"done"});
  EXPECT_FALSE(table_->get("done"));
  EXPECT_TRUE(table_->events("done", 0, 10)->empty());
  EXPECT_TRUE(table_->get("running"));
  EXPECT_TRUE(table_->get("queued"));
  change("running", succeeded);
  ASSERT_EQ(table_->forget_ended({4e9})->size(), 1u);
  EXPECT_EQ(*table_->counts(), (std::vector<std::uint64_t>{0, 1, 0, 0, 0, 0, 0}));
}

// The newest jobs are kept, as many as fit; pictures count where the daemon keeps them.
TEST_F(JobTableTest, ForgetsTheOldestThatDoNotFit) {
  for (int i = 0; i < 5; ++i) {
    const std::string id = "job" + std::to_string(i);
    bring(id, running);
    ASSERT_TRUE(table_->add_result(id, {0, "end", (i == 3 ? "/out/" : "/a/state/folder/results/") + id, 100, "aa"}).ok());
    change(id, succeeded);
  }
  const auto forget = [&](std::uint64_t jobs, std::uint64_t bytes) {
    auto ids = table_->forget_ended({0, jobs, bytes, "/a/state/folder/results"});
    EXPECT_TRUE(ids) << ids.error().to_string();
    return ids ? *ids : std::vector<std::string>();
  };
  EXPECT_TRUE(forget(5, 400).empty());
  EXPECT_EQ(forget(5, 399), std::vector<std::string>{"job0"});
  EXPECT_EQ(forget(3, 300), std::vector<std::string>{"job1"});
  EXPECT_EQ(forget(3, 199), std::vector<std::string>{"job2"});
  EXPECT_TRUE(forget(3, 100).empty());
  EXPECT_EQ(forget(3, 99), std::vector<std::string>{}) << "the newest stays, and the one before has none here";
  EXPECT_EQ(forget(0, 0).size(), 2u);
}

// Of a long request the table keeps the whole apart, until the job is at its end.
TEST_F(JobTableTest, LongRequestsAreKeptApart) {
  JobRecord job = make_job("one");
  job.client_token = "token";
  job.request = std::string(100000, 'v');
  job.summary = "in short";
  ASSERT_TRUE(table_->submit(job, kMany, "tester"));
  submit("short");
  EXPECT_EQ(table_->get("one")->summary, "in short");
  EXPECT_EQ(table_->get("one")->request, "");
  EXPECT_EQ(*table_->request("one"), job.request);
  EXPECT_EQ(*table_->request("short"), make_job("short").request);
  EXPECT_TRUE(JobTable::has_request(*table_->get("one"), job.request));
  EXPECT_FALSE(JobTable::has_request(*table_->get("one"), "in short"));
  expect_error(table_->request("none").error(), ErrorCode::not_found, {"none"});

  // 100,000 bytes are there; the limit is reached with the next one's last byte.
  JobRecord huge = make_job("huge");
  huge.summary = "in short";
  huge.request = std::string(JobTable::kMostRequestBytes - 100000 + 1, 'v');
  expect_error(table_->submit(huge, kMany, "tester").error(), ErrorCode::resource_exhausted,
               {"100000 bytes", "allowed: 1073741824"});
  EXPECT_FALSE(table_->get("huge"));

  change("one", running);
  change("one", succeeded);
  expect_error(table_->request("one").error(), ErrorCode::failed_precondition, {"SUCCEEDED"});
  JobRecord again = job;
  again.id = "two";
  EXPECT_TRUE(table_->submit(again, kMany, "tester")->already_there);
  again.request.back() = 'w';
  expect_error(table_->submit(again, kMany, "tester").error(), ErrorCode::invalid_argument, {"another request"});
}

// The states' counters follow each row, one by one.
TEST_F(JobTableTest, CountsFollowEveryChange) {
  const auto expect_counts = [this](const std::string& when) {
    const auto counts = table_->counts();
    ASSERT_TRUE(counts) << counts.error().to_string();
    for (const JobState state : kJobStates) {
      const auto rows = table_->in_state(state);
      ASSERT_TRUE(rows) << rows.error().to_string();
      EXPECT_EQ((*counts)[std::size_t(state)], rows->size()) << when << ", " << to_string(state);
    }
  };
  expect_counts("at first");
  for (const JobState state : kJobStates) bring("to " + std::string(to_string(state)), state);
  expect_counts("one of each");
  EXPECT_FALSE(table_->change("to SUCCEEDED", {queued}));
  EXPECT_FALSE(table_->submit(make_job("to QUEUED"), kMany, "tester"));
  expect_counts("after refusals");
  ASSERT_TRUE(table_->set_priority("to QUEUED", 3));
  ASSERT_TRUE(table_->forget_ended({1e18}));
  EXPECT_EQ((*table_->counts())[std::size_t(queued)], 1u);
  EXPECT_EQ((*table_->counts())[std::size_t(failed)], 0u);
  expect_counts("after the end of some");
}

TEST_F(JobTableTest, ATableOfTheFirstVersionIsCounted) {
  for (const JobState state : kJobStates) bring("to " + std::string(to_string(state)), state);
  const std::string request = *table_->request("to QUEUED");
  table_.reset();
  const std::string file = folder_ / "jobs.sqlite";
  {
    auto database = SqliteDatabase::open(file, SqliteDatabase::Access::write);
    ASSERT_TRUE(database) << database.error().to_string();
    const Status undone = (*database)->execute(
        "DROP TABLE requests; DROP TABLE request_bytes; ALTER TABLE jobs RENAME COLUMN summary TO request; "
        "ALTER TABLE jobs DROP COLUMN request_sha256; "
        "DROP TRIGGER job_added; DROP TRIGGER job_changed; DROP TRIGGER job_removed; DROP TABLE job_counts; "
        "PRAGMA user_version = 1");
    ASSERT_TRUE(undone.ok()) << undone.error().to_string();
  }
  std::vector<std::string> notices;
  auto table = JobTable::open(file, notices);
  ASSERT_TRUE(table) << table.error().to_string();
  EXPECT_EQ(notices.size(), 1u);
  EXPECT_EQ(*(*table)->request("to QUEUED"), request);
  EXPECT_TRUE(JobTable::has_request(*(*table)->get("to QUEUED"), request));
  for (const JobState state : kJobStates) EXPECT_EQ((*(*table)->counts())[std::size_t(state)], 1u) << to_string(state);
}

TEST_F(JobTableTest, ThoseWhoWatchAreToldAfterTheCommit) {
  std::vector<std::uint64_t> newest;
  table_->on_events([&] { newest.push_back(table_->events("", 0, 100)->back().seq); });
  submit("a");
  change("a", running);
  EXPECT_EQ(newest, (std::vector<std::uint64_t>{1, 2}));
  ASSERT_TRUE(table_->set_priority("a", 3));
  EXPECT_FALSE(table_->change("a", {running}));
  EXPECT_EQ(newest.size(), 2u);
}

// Eight threads submit and change their jobs beside one that reads: nothing is lost, every event has a number of its
// own, and those of a job are in order.
TEST_F(JobTableTest, ThreadsShareTheTable) {
  constexpr int kThreads = 8, kEach = 25;
  std::atomic<bool> done = false;
  std::jthread reader([&] {
    std::uint64_t most = 0;
    while (!done) {
      const auto page = table_->list({}, "", 10);
      ASSERT_TRUE(page) << page.error().to_string();
      EXPECT_GE(page->total, most);
      most = page->total;
    }
  });
  std::vector<std::jthread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0; i < kEach; ++i) {
        const std::string id = std::to_string(thread) + "-" + std::to_string(i);
        submit(id);
        change(id, running);
        change(id, succeeded);
      }
    });
  }
  threads.clear();
  done = true;
  reader.join();
  EXPECT_EQ((*table_->counts())[std::size_t(succeeded)], std::uint64_t(kThreads * kEach));
  const auto events = table_->events("", 0, 10000);
  ASSERT_TRUE(events);
  EXPECT_EQ(events->size(), std::size_t(3 * kThreads * kEach));
  std::map<std::string, std::vector<JobState>> by_job;
  for (std::size_t i = 0; i < events->size(); ++i) {
    EXPECT_EQ((*events)[i].seq, i + 1);
    by_job[(*events)[i].job_id].push_back((*events)[i].to);
  }
  for (const auto& [id, states] : by_job) EXPECT_EQ(states, (std::vector{queued, running, succeeded})) << id;
}

// Of many that want the last place, or use the same token, one gets it.
TEST_F(JobTableTest, ThreadsDoNotOvertakeLimits) {
  std::atomic<int> taken = 0, fresh = 0;
  std::vector<std::jthread> threads;
  for (int thread = 0; thread < 8; ++thread) {
    threads.emplace_back([&, thread] {
      JobRecord job = make_job("token" + std::to_string(thread));
      job.client_token = "same";
      job.request = "same";
      const auto submitted = table_->submit(job, kMany, "tester");
      fresh += submitted && !submitted->already_there;
      taken += table_->submit(make_job(std::to_string(thread)), 4, "tester").ok();
    });
  }
  threads.clear();
  EXPECT_EQ(fresh, 1);
  EXPECT_EQ(taken, 3);  // beside the one with the token
}

}  // namespace
}  // namespace helio::test
