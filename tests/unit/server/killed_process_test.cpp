// Processes that end in the middle of their work: what they have said is done is there.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <sstream>
#include <thread>

#include "server/state/checkpoint_files.h"
#include "server/state/job_table.h"
#include "state_process.h"
#include "tests/support/random.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

// Waits until the process has said so many bytes, and kills it.
std::string kill_after(Process& process, std::size_t bytes) {
  // Long enough for any machine; one that has ended by itself fails below.
  for (int i = 0; i < 60'000 && process.output().size() < bytes; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  process.send_signal(SIGKILL);
  const ProcessResult result = process.wait();
  EXPECT_EQ(result.signal, SIGKILL) << result.out << result.err;
  // A line without an end was not said.
  return result.out.substr(0, result.out.rfind('\n') + 1);
}

TEST(KilledProcess, LosesNoJobThatWasAnswered) {
  TemporaryFolder folder;
  const std::string file = folder / "jobs.sqlite";
  Random random(7);
  std::map<std::string, std::string> last_word;  // by job
  for (int round = 0; round < by_tier(5, 30); ++round) {
    Process process(this_program(), {"submit", file}, folder.path());
    std::istringstream said(kill_after(process, 2000 + random.next_u32() % 8000));
    std::string id, word;
    while (said >> id >> word) last_word[id] = word;
    EXPECT_FALSE(last_word.contains("failed:"));

    std::vector<std::string> notices;
    const auto table = JobTable::open(file, notices);
    ASSERT_TRUE(table) << table.error().to_string();
    ASSERT_TRUE(notices.empty()) << notices[0];
    for (const auto& [job_id, done] : last_word) {
      const auto job = (*table)->get(job_id);
      ASSERT_TRUE(job) << job_id << " " << done;
      EXPECT_EQ(job->summary, make_job(job_id).request);
      // At least as far as was said; the next step may have been on its way.
      const std::uint32_t steps = job->state == JobState::queued      ? 0
                                  : job->state == JobState::succeeded ? 3
                                                                      : 1 + job->views_done;
      const std::uint32_t expected = done == "submitted" ? 0 : done == "running" ? 1 : done == "view" ? 2 : 3;
      EXPECT_GE(steps, expected) << job_id << " " << done;
      EXPECT_LE(steps, expected + 1) << job_id << " " << done;
      // Job and events agree: they were committed together.
      const auto events = (*table)->events(job_id, 0, 10);
      ASSERT_TRUE(events && !events->empty());
      EXPECT_EQ(events->back().to, job->state);
      EXPECT_EQ(events->back().seq, job->updated_seq);
    }
    const auto all = (*table)->events("", 0, 1 << 20);
    for (std::size_t i = 0; i < all->size(); ++i) ASSERT_EQ((*all)[i].seq, i + 1);
  }
  EXPECT_GT(last_word.size(), 100u);
}

TEST(KilledProcess, LeavesAWholeCheckpoint) {
  TemporaryFolder folder;
  const std::string path = folder / "checkpoints";
  Random random(8);
  std::uint64_t said_last = 0;
  for (int round = 0; round < by_tier(8, 50); ++round) {
    Process process(this_program(), {"checkpoints", path}, folder.path());
    std::istringstream said(kill_after(process, 1 + random.next_u32() % 30));
    for (std::uint64_t number = 0; said >> number;) {
      EXPECT_EQ(number, said_last + 1);
      said_last = number;
    }
    const auto found = CheckpointFiles(path).read("job", 1 << 30);
    ASSERT_TRUE(found.file) << "after " << said_last;
    EXPECT_TRUE(found.damaged.empty()) << found.damaged[0];
    // The next one may have come into its place without a word.
    EXPECT_GE(found.file->number, said_last);
    EXPECT_LE(found.file->number, said_last + 1);
    EXPECT_EQ(found.file->body, checkpoint_body(found.file->number));
    said_last = found.file->number;
  }
  CheckpointFiles files(path);
  ASSERT_TRUE(files.open().ok());
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(name == "job.a" || name == "job.b") << name;
  }
}

}  // namespace
}  // namespace helio::test
