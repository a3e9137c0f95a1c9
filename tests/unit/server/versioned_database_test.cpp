// Databases that are damaged, of another kind, older or newer.
#include "server/state/versioned_database.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "server/state/job_table.h"
#include "state_process.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 3> kSteps = {
    "CREATE TABLE animals (name TEXT); INSERT INTO animals VALUES ('cat')",
    "ALTER TABLE animals ADD COLUMN legs INTEGER NOT NULL DEFAULT 4",
    "CREATE INDEX animals_by_legs ON animals (legs); UPDATE animals SET name = name || 's'"};

DatabaseSchema schema(std::size_t version, std::int32_t id = 77) {
  return {id, std::span(kSteps).first(version)};
}

class VersionedDatabaseTest : public testing::Test {
 protected:
  Result<std::unique_ptr<SqliteDatabase>> open(const DatabaseSchema& of) {
    notices_.clear();
    return open_versioned_database(file_, of, notices_);
  }
  // Files in the folder that were set aside.
  std::vector<std::string> aside() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      const std::string name = entry.path().filename().string();
      if (name.find(".damaged-") != std::string::npos) names.push_back(name);
    }
    return names;
  }

  TemporaryFolder folder_;
  std::string file_ = folder_ / "db.sqlite";
  std::vector<std::string> notices_;
};

TEST_F(VersionedDatabaseTest, ANewOneHasTheNewestVersion) {
  const auto database = open(schema(3));
  ASSERT_TRUE(database) << database.error().to_string();
  EXPECT_TRUE(notices_.empty());
  EXPECT_EQ(*(*database)->query_integer("PRAGMA user_version"), 3);
  EXPECT_EQ(*(*database)->query_integer("SELECT legs FROM animals WHERE name = 'cats'"), 4);
  EXPECT_EQ(*(*database)->query_integer("PRAGMA synchronous"), 2);  // FULL
  EXPECT_EQ(*(*database)->query_integer("PRAGMA foreign_keys"), 1);
}

TEST_F(VersionedDatabaseTest, AnOlderOneIsMigrated) {
  ASSERT_TRUE((*open(schema(1)))->run("INSERT INTO animals VALUES ('bird')").ok());
  const auto database = open(schema(3));
  ASSERT_TRUE(database) << database.error().to_string();
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_NE(notices_[0].find("from version 1 to 3"), std::string::npos) << notices_[0];
  EXPECT_EQ(*(*database)->query_integer("SELECT count(*) FROM animals WHERE name IN ('cats', 'birds') AND legs = 4"),
            2);
  EXPECT_EQ(*(*database)->query_integer("PRAGMA user_version"), 3);
}

// One transaction: a step that fails leaves the version that was there.
TEST_F(VersionedDatabaseTest, AMigrationThatFailsChangesNothing) {
  ASSERT_TRUE(open(schema(1)));
  const std::array<std::string_view, 3> broken = {kSteps[0], kSteps[1], "INSERT INTO plants VALUES (1)"};
  const auto refused = open({77, broken});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().to_string().find("plants"), std::string::npos) << refused.error().to_string();
  const auto database = open(schema(1));
  ASSERT_TRUE(database);
  EXPECT_FALSE((*database)->query("SELECT legs FROM animals"));
  EXPECT_TRUE(aside().empty());
}

TEST_F(VersionedDatabaseTest, ANewerOneIsRefused) {
  ASSERT_TRUE(open(schema(3)));
  const auto refused = open(schema(2));
  ASSERT_FALSE(refused);
  EXPECT_EQ(int(refused.error().code), int(ErrorCode::failed_precondition));
  EXPECT_EQ(refused.error().to_string(),
            file_ + ": the database has version 3, written by a newer program; this one knows versions up to 2. Use "
                    "the newer program or another state folder");
  EXPECT_TRUE(aside().empty());
  EXPECT_TRUE(open(schema(3)));
}

TEST_F(VersionedDatabaseTest, OneOfAnotherKindIsSetAside) {
  ASSERT_TRUE(open(schema(1, 78)));
  const auto database = open(schema(1));
  ASSERT_TRUE(database) << database.error().to_string();
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_NE(notices_[0].find("application id 78"), std::string::npos) << notices_[0];
  ASSERT_EQ(aside().size(), 1u);
  std::vector<std::string> none;
  EXPECT_TRUE(open_versioned_database(folder_ / aside()[0], schema(1, 78), none));
  EXPECT_TRUE(none.empty());
}

TEST_F(VersionedDatabaseTest, EveryDamagedOneIsKept) {
  write_file(file_, std::string(5000, 'x'));
  ASSERT_TRUE(open(schema(1)));
  write_file(file_, std::string(5000, 'y'));  // within the same second, too
  fs::remove(file_ + "-wal");
  ASSERT_TRUE(open(schema(1)));
  std::string contents;
  for (const std::string& name : aside()) contents += read_file(folder_ / name)[0];
  std::sort(contents.begin(), contents.end());
  EXPECT_EQ(contents, "xy");
}

// SQLite would remove the log of a database file that has lost its bytes.
TEST_F(VersionedDatabaseTest, AnEmptyFileBesideALogIsDamage) {
  write_file(file_, "");
  write_file(file_ + "-wal", "log");
  ASSERT_TRUE(open(schema(1)));
  ASSERT_EQ(notices_.size(), 1u);
  EXPECT_NE(notices_[0].find("empty"), std::string::npos) << notices_[0];
  EXPECT_EQ(aside().size(), 2u);
}

// A table of 60 jobs, damaged in one page after the other. Each time it is used as it was, or set aside whole and told,
// together with its log; never does opening fail.
TEST(DamagedJobTable, IsToldAndKept) {
  TemporaryFolder folder;
  const std::string whole = folder / "whole.sqlite", file = folder / "jobs.sqlite";
  std::vector<std::string> notices;
  {
    auto table = JobTable::open(whole, notices);
    ASSERT_TRUE(table);
    for (int i = 0; i < 60; ++i) {
      const std::string id = "job" + std::to_string(i);
      JobRecord job = make_job(id);
      job.request.append(1000, 'r');
      ASSERT_TRUE((*table)->submit(job, 100, "tester"));
      if (i % 2 == 1) continue;
      ASSERT_TRUE((*table)->change(id, {JobState::running}));
    }
  }
  const std::string bytes = read_file(whole);
  constexpr std::size_t kPage = 4096;
  ASSERT_GT(bytes.size(), 20 * kPage);
  std::size_t told = 0, cases = 0;
  const auto try_one = [&](const std::string& damaged, const std::string& what) {
    ++cases;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      if (entry.path().filename().string().rfind("jobs.sqlite", 0) == 0) fs::remove(entry.path());
    }
    write_file(file, damaged);
    notices.clear();
    auto table = JobTable::open(file, notices);
    ASSERT_TRUE(table) << what << ": " << table.error().to_string();
    if (notices.empty()) return;
    ++told;
    EXPECT_NE(notices[0].find("damaged"), std::string::npos) << notices[0];
    EXPECT_EQ((*table)->list({}, "", 100)->total, 0u) << what;
    EXPECT_TRUE((*table)->submit(make_job("new"), 100, "tester")) << what;
    const std::size_t name = notices[0].find("kept as ") + 8;
    EXPECT_EQ(read_file(notices[0].substr(name, notices[0].find(',', name) - name)), damaged) << what;
  };
  for (std::size_t page = 0; page < bytes.size() / kPage; ++page) {
    std::string damaged = bytes;
    // The page's header, which says where its cells are, and the pointers to them.
    for (std::size_t i = page == 0 ? 100 : 0; i < 200; ++i) damaged[page * kPage + i] = char(0x5a);
    try_one(damaged, "page " + std::to_string(page));
  }
  EXPECT_EQ(told, cases);
  try_one(bytes.substr(0, bytes.size() / 2), "half of it");
  try_one(bytes.substr(0, 1000), "a quarter of its first page");
  try_one("no database, " + bytes, "something before it");
  try_one(std::string(bytes.size(), '\0'), "zeros");
  EXPECT_EQ(told, cases);
  try_one(bytes, "nothing");
  EXPECT_EQ(told + 1, cases);
}

// A log that is cut or damaged after a crash ends with the last commit that is whole.
TEST(DamagedJobTable, ALogIsReadUpToItsDamage) {
  TemporaryFolder folder;
  const std::string live = folder / "live.sqlite", file = folder / "jobs.sqlite";
  std::vector<std::string> notices;
  auto table = JobTable::open(live, notices);
  ASSERT_TRUE(table);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE((*table)->submit(make_job("job" + std::to_string(i)), 100, "tester"));
  // As a crash would leave them.
  const std::string database = read_file(live), log = read_file(live + "-wal");
  ASSERT_GT(log.size(), 40u * 4096);
  const auto jobs_of = [&](const std::string& log_bytes) -> std::uint64_t {
    fs::remove(file + "-shm");
    write_file(file, database);
    write_file(file + "-wal", log_bytes);
    notices.clear();
    auto copy = JobTable::open(file, notices);
    EXPECT_TRUE(copy && notices.empty()) << (copy ? notices[0] : copy.error().to_string());
    const auto page = (*copy)->list({}, "", 100);
    EXPECT_TRUE(page);
    // The oldest jobs, without gaps.
    for (std::size_t i = 0; i < page->jobs.size(); ++i) {
      EXPECT_EQ(page->jobs[page->jobs.size() - 1 - i].id, "job" + std::to_string(i));
    }
    return page->total;
  };
  EXPECT_EQ(jobs_of(log), 20u);
  std::uint64_t most = 0;
  for (std::size_t size = log.size() / 2; size < log.size(); size += log.size() / 31) {
    const std::uint64_t jobs = jobs_of(log.substr(0, size));
    EXPECT_GE(jobs, most);
    EXPECT_LT(jobs, 20u);
    most = jobs;
    std::string flipped = log;
    flipped[size] = char(flipped[size] ^ 1);
    EXPECT_EQ(jobs_of(flipped), jobs);
  }
  EXPECT_GT(most, 5u);
}

}  // namespace
}  // namespace helio::test
