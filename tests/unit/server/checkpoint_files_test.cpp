#include "server/state/checkpoint_files.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "state_process.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kMax = 1 << 30;

class CheckpointFilesTest : public testing::Test {
 protected:
  CheckpointFilesTest() { EXPECT_TRUE(files_.open().ok()); }

  void write(const std::string& job, const std::string& header, const Bytes& body) {
    const std::array<std::span<const std::uint8_t>, 1> parts = {body};
    const Status written = files_.write(job, header, parts);
    EXPECT_TRUE(written.ok()) << written.error().to_string();
  }
  // As another process finds them.
  CheckpointFiles::Newest read(const std::string& job) const { return CheckpointFiles(path_).read(job, kMax); }
  std::string slot(const std::string& ending) const { return path_ + "/job" + ending; }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "checkpoints";
  CheckpointFiles files_{path_};
};

TEST_F(CheckpointFilesTest, HeadsAreReadWithoutTheBody) {
  EXPECT_TRUE(files_.job_ids().empty());
  EXPECT_FALSE(files_.read_head("job").file);
  write("job", "one", Bytes(3 << 20, 7));
  write("job", "two", Bytes(3 << 20, 8));
  write("another", "", {});
  EXPECT_EQ(files_.job_ids(), (std::vector<std::string>{"another", "job"}));
  std::string bytes = read_file(slot(".b"));
  bytes.back() ^= 1;
  write_file(slot(".b"), bytes);
  const auto head = files_.read_head("job");
  ASSERT_TRUE(head.file);
  EXPECT_EQ(head.file->header, "two");
  EXPECT_EQ(head.file->number, 2u);
  EXPECT_TRUE(head.file->body.empty());
  EXPECT_TRUE(head.damaged.empty());
  EXPECT_EQ(read("job").file->header, "one") << "the body of the newest is damaged";
  bytes[50] ^= 1;
  write_file(slot(".b"), bytes);
  EXPECT_EQ(files_.read_head("job").file->header, "one");
  EXPECT_EQ(files_.read_head("job").damaged.size(), 1u);
}

TEST_F(CheckpointFilesTest, TheNewestIsRead) {
  EXPECT_FALSE(read("job").file);
  EXPECT_TRUE(read("job").damaged.empty());
  for (std::uint8_t i = 1; i <= 5; ++i) {
    write("job", "header " + std::to_string(i), Bytes(i * 10, i));
    const auto newest = read("job");
    ASSERT_TRUE(newest.file);
    EXPECT_EQ(newest.file->number, i);
    EXPECT_EQ(newest.file->header, "header " + std::to_string(i));
    EXPECT_EQ(newest.file->body, Bytes(i * 10, i));
    EXPECT_TRUE(newest.damaged.empty());
    EXPECT_EQ(files_.look("job", kMax).file->body, newest.file->body);
  }
  const auto before = files_.read_before("job", 5, kMax);
  ASSERT_TRUE(before.file);
  EXPECT_EQ(before.file->number, 4u);
  EXPECT_FALSE(files_.read_before("job", 4, kMax).file);
  EXPECT_FALSE(read("job2").file);
  // Two files, and nothing else.
  EXPECT_EQ(std::distance(fs::directory_iterator(path_), fs::directory_iterator()), 2);
  files_.remove("job");
  EXPECT_TRUE(fs::is_empty(path_));
  EXPECT_FALSE(files_.read("job", kMax).file);
}

// Spans that end within, at and behind the pieces of 1 MiB that have a checksum each.
TEST_F(CheckpointFilesTest, ABodyOfManySpansIsOne) {
  constexpr std::size_t kMiB = 1 << 20;
  Random random(1);
  Bytes body(5 * kMiB + 3);
  for (auto& byte : body) byte = std::uint8_t(random.next_u32());
  std::vector<std::span<const std::uint8_t>> parts;
  std::size_t begin = 0;
  for (const std::size_t end : {std::size_t(0), std::size_t(1), kMiB - 1, kMiB, 2 * kMiB, 4 * kMiB + 7, body.size()}) {
    parts.push_back(std::span(body).subspan(begin, end - begin));
    begin = end;
  }
  ASSERT_TRUE(files_.write("job", "", parts).ok());
  EXPECT_EQ(read("job").file->body, body);
  ASSERT_TRUE(files_.write("job", "nothing", {}).ok());
  EXPECT_EQ(read("job").file->body, Bytes());
}

// Every cut of a small file and every flipped bit of it: the one before is read, and the file is named.
TEST_F(CheckpointFilesTest, EveryCutAndEveryBitOfASmallOneIsNoticed) {
  write("job", "old", Bytes(3, 7));
  write("job", "new", Bytes(41, 9));
  const std::string bytes = read_file(slot(".b"));
  ASSERT_EQ(bytes.size(), 40u + 3 + 3 + 8 + 41);  // start, job id, header, two checksums, body
  const auto expect_old = [&](const std::string& damaged, std::size_t place) {
    write_file(slot(".b"), damaged);
    const auto found = read("job");
    ASSERT_TRUE(found.file) << place;
    EXPECT_EQ(found.file->header, "old") << place;
    ASSERT_EQ(found.damaged.size(), 1u) << place;
    EXPECT_EQ(found.damaged[0].rfind(slot(".b") + ": ", 0), 0u) << found.damaged[0];
  };
  for (std::size_t size = 0; size < bytes.size(); ++size) expect_old(bytes.substr(0, size), size);
  expect_old(bytes + '\0', bytes.size() + 1);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::string flipped = bytes;
    flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
    expect_old(flipped, bit);
  }
  write_file(slot(".b"), bytes);
  EXPECT_EQ(read("job").file->header, "new");
}

// 1,000 random cuts, flips and overwritten stretches of 3 MB.
TEST_F(CheckpointFilesTest, RandomDamageOfALargeOneIsNoticed) {
  Random random(39);
  Bytes body(3'000'000);
  for (auto& byte : body) byte = std::uint8_t(random.next_u32());
  write("job", "old", Bytes(3, 7));
  write("job", "new", body);
  const std::string bytes = read_file(slot(".b"));
  for (int i = 0; i < 1000; ++i) {
    std::string damaged = bytes;
    const std::size_t place = random.next_u32() % bytes.size();
    if (i % 3 == 0) {
      damaged.resize(place);
    } else if (i % 3 == 1) {
      damaged[place] = char(damaged[place] ^ (1 << random.next_u32() % 8));
    } else {
      const std::size_t end = std::min(bytes.size(), place + 1 + random.next_u32() % 100'000);
      for (std::size_t at = place; at < end; ++at) damaged[at] = char(random.next_u32());
      if (damaged == bytes) continue;
    }
    write_file(slot(".b"), damaged);
    const auto found = CheckpointFiles(path_).read("job", kMax);
    ASSERT_TRUE(found.file) << i;
    ASSERT_EQ(found.file->header, "old") << "case " << i << " at byte " << place;
    ASSERT_EQ(found.damaged.size(), 1u) << i;
  }
}

TEST_F(CheckpointFilesTest, BothDamagedIsNothingAndTold) {
  write("job", "old", Bytes(3, 7));
  write("job", "new", Bytes(3, 8));
  for (const char* ending : {".a", ".b"}) write_file(slot(ending), "rubbish");
  const auto found = read("job");
  EXPECT_FALSE(found.file);
  EXPECT_EQ(found.damaged.size(), 2u);
  write("job", "again", Bytes(3, 9));
  EXPECT_EQ(read("job").file->header, "again");
}

// The next checkpoint replaces the damaged one, not the one that is whole.
TEST_F(CheckpointFilesTest, ADamagedOneIsReplacedFirst) {
  write("job", "old", Bytes(3, 7));
  write("job", "new", Bytes(3, 8));
  std::string bytes = read_file(slot(".b"));
  bytes.back() = char(~bytes.back());
  write_file(slot(".b"), bytes);
  CheckpointFiles after_restart(path_);
  ASSERT_EQ(after_restart.read("job", kMax).file->header, "old");
  ASSERT_TRUE(after_restart.write("job", "newer", {}).ok());
  EXPECT_EQ(read("job").file->header, "newer");
  EXPECT_EQ(read("job").file->number, 3u);
  const auto before = after_restart.read_before("job", 3, kMax);
  ASSERT_TRUE(before.file);
  EXPECT_EQ(before.file->header, "old");
}

TEST_F(CheckpointFilesTest, AFileOfAnotherJobOrVersionOrTooLargeIsTold) {
  write("job", "mine", Bytes(100, 7));
  write("other", "another's", Bytes(100, 7));
  fs::copy_file(path_ + "/other.a", slot(".b"));
  auto found = read("job");
  EXPECT_EQ(found.file->header, "mine");
  ASSERT_EQ(found.damaged.size(), 1u);
  EXPECT_NE(found.damaged[0].find("job 'other'"), std::string::npos) << found.damaged[0];

  std::string newer = read_file(slot(".a"));
  newer[8] = 2;
  write_file(slot(".b"), newer);
  found = read("job");
  ASSERT_EQ(found.damaged.size(), 1u);
  EXPECT_NE(found.damaged[0].find("version 2; this program reads version 1"), std::string::npos) << found.damaged[0];

  fs::remove(slot(".b"));
  const auto limited = files_.read("job", 99);
  EXPECT_FALSE(limited.file);
  ASSERT_EQ(limited.damaged.size(), 1u);
  EXPECT_NE(limited.damaged[0].find("allowed: at most 99"), std::string::npos) << limited.damaged[0];
}

TEST_F(CheckpointFilesTest, JobIdsAreFileNames) {
  for (const std::string id : {"", "..", "a/b", "a.b", "a b"}) {
    const Status refused = files_.write(id, "", {});
    ASSERT_FALSE(refused.ok()) << id;
    EXPECT_EQ(int(refused.error().code), int(ErrorCode::invalid_argument)) << id;
    EXPECT_FALSE(files_.read(id, kMax).file) << id;
    files_.remove(id);
  }
  EXPECT_FALSE(files_.write(std::string(129, 'a'), "", {}).ok());
  write(std::string(128, 'a'), "", {});
}

TEST_F(CheckpointFilesTest, OpeningRemovesWhatWasNotFinished) {
  write("job", "whole", Bytes(3, 7));
  write_file(path_ + "/job.b.tmp-123-4", "half");
  CheckpointFiles again(path_);
  ASSERT_TRUE(again.open().ok());
  EXPECT_FALSE(fs::exists(path_ + "/job.b.tmp-123-4"));
  EXPECT_EQ(again.read("job", kMax).file->header, "whole");
  write_file(folder_ / "file", "");
  CheckpointFiles nowhere(folder_ / "file/checkpoints");
  EXPECT_EQ(int(nowhere.open().error().code), int(ErrorCode::unavailable));
  const Status refused = nowhere.write("job", "", {});
  EXPECT_FALSE(refused.ok());
}

}  // namespace
}  // namespace helio::test
