#include "renderer/codec/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/unit/picture/temporary_folder.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string content(const fs::path& path) {
  const auto bytes = read_whole_file(path.string(), 100);
  return bytes ? std::string(bytes->begin(), bytes->end()) : bytes.error().to_string();
}

int entries(const fs::path& folder) {
  return int(std::distance(fs::directory_iterator(folder), {}));
}

TEST(AtomicFile, ReplacesAFileAndLeavesNothingBeside) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "file";
  ASSERT_TRUE(write_file_atomically(file.string(), bytes_of("old")).ok());
  ASSERT_TRUE(write_file_atomically(file.string(), bytes_of("new")).ok());
  EXPECT_EQ(content(file), "new");
  EXPECT_EQ(entries(folder.path()), 1);
}

// As a process of the same number leaves them, that of the container before this one.
TEST(AtomicFile, IsNotDisturbedByTemporaryFilesOfItsNames) {
  const test::TemporaryFolder folder;
  const std::string file = (folder.path() / "file").string();
  constexpr int kLeft = 200;
  for (int i = 1; i <= kLeft; ++i)
    std::ofstream(file + ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(i)) << "half";
  ASSERT_TRUE(write_file_atomically(file, bytes_of("new")).ok());
  EXPECT_EQ(content(file), "new");
  EXPECT_EQ(entries(folder.path()), kLeft + 1);
}

// Renaming would end what others write to and read from.
TEST(AtomicFile, DevicesPipesAndFoldersAreNotReplaced) {
  const test::TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe", inner = folder.path() / "folder";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directory(inner);
  for (const fs::path& path : {pipe, inner, fs::path("/dev/null")}) {
    const Status written = write_file_atomically(path.string(), bytes_of("text"));
    ASSERT_FALSE(written.ok()) << path;
    EXPECT_EQ(int(written.error().code), int(ErrorCode::invalid_argument));
    EXPECT_NE(written.error().to_string().find(path.string()), std::string::npos) << written.error().to_string();
  }
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(entries(folder.path()), 2);
}

TEST(AtomicFile, WritesWhereALinkLeads) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "there");
  fs::create_symlink("there/file", folder.path() / "link");
  for (const char* text : {"a target that comes", "one that is there"}) {
    ASSERT_TRUE(write_file_atomically((folder.path() / "link").string(), bytes_of(text)).ok());
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
    EXPECT_EQ(content(folder.path() / "there/file"), text);
  }
  EXPECT_EQ(entries(folder.path() / "there"), 1);

  fs::create_symlink("/dev/null", folder.path() / "to device");
  EXPECT_FALSE(write_file_atomically((folder.path() / "to device").string(), bytes_of("text")).ok());
  fs::create_symlink("round", folder.path() / "round");
  EXPECT_FALSE(write_file_atomically((folder.path() / "round").string(), bytes_of("text")).ok());
  EXPECT_TRUE(fs::is_symlink(folder.path() / "round"));
}

TEST(AtomicFile, AFileThatIsThereStaysWithoutReplace) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "file").string();
  ASSERT_TRUE(write_file_atomically(path, bytes_of("old")).ok());
  {
    auto file = AtomicFile::create(path);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->write(bytes_of("new")).ok());
    const Status put = file->commit(Flush::now, false);
    ASSERT_FALSE(put.ok());
    EXPECT_EQ(int(put.error().code), int(ErrorCode::failed_precondition));
  }
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(entries(folder.path()), 1);
}

}  // namespace
}  // namespace helio
