// What a FileSource may and may not read.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "renderer/scene/load/scene_loader.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

// A folder of its own with root/inside.bin, root/sub/deep.bin, outside.bin and links.
class DirectorySourceTest : public testing::Test {
 protected:
  void SetUp() override {
    base_ = fs::temp_directory_path() / ("helio_source_" + std::to_string(::getpid()));
    fs::create_directories(base_ / "root/sub");
    write("root/inside.bin", "in");
    write("root/sub/deep.bin", "deep");
    write("outside.bin", "secret");
    fs::create_symlink("../outside.bin", base_ / "root/leak.bin");
    fs::create_symlink("sub/deep.bin", base_ / "root/link.bin");
    fs::create_directory_symlink("..", base_ / "root/up");
    source_ = make_directory_source((base_ / "root").string());
  }
  void TearDown() override { fs::remove_all(base_); }
  void write(const char* name, const char* text) { std::ofstream(base_ / name) << text; }

  ErrorCode code(const char* path) {
    const auto bytes = source_->read(path, 100);
    EXPECT_FALSE(bytes.ok()) << path;
    return bytes.ok() ? ErrorCode::internal : bytes.error().code;
  }

  fs::path base_;
  std::unique_ptr<FileSource> source_;
};

TEST_F(DirectorySourceTest, ReadsWhatIsInside) {
  EXPECT_EQ(source_->read("inside.bin", 100)->size(), 2u);
  EXPECT_EQ(source_->read("sub/deep.bin", 4)->size(), 4u);
  EXPECT_EQ(source_->read("link.bin", 4)->size(), 4u);  // a link that stays inside
}

TEST_F(DirectorySourceTest, RefusesWhatIsNot) {
  EXPECT_EQ(code("leak.bin"), ErrorCode::permission_denied);
  EXPECT_EQ(code("up/outside.bin"), ErrorCode::permission_denied);
  EXPECT_EQ(code("../outside.bin"), ErrorCode::permission_denied);
  EXPECT_EQ(code("sub/../../outside.bin"), ErrorCode::permission_denied);
  EXPECT_EQ(code("/etc/passwd"), ErrorCode::permission_denied);
  EXPECT_EQ(code("c:\\x"), ErrorCode::permission_denied);
  EXPECT_EQ(code("nothing.bin"), ErrorCode::not_found);
  EXPECT_EQ(code("sub"), ErrorCode::not_found);
  EXPECT_EQ(code(""), ErrorCode::invalid_argument);
}

TEST_F(DirectorySourceTest, ChecksTheSizeBeforeReading) {
  const auto bytes = source_->read("sub/deep.bin", 3);
  ASSERT_FALSE(bytes.ok());
  EXPECT_EQ(bytes.error().code, ErrorCode::resource_exhausted);
}

TEST(MemorySource, NamesAreNormalised) {
  const auto source = make_memory_source({{"a/b.bin", {1, 2, 3}}});
  EXPECT_EQ(source->read("a/b.bin", 3)->size(), 3u);
  EXPECT_EQ(source->read("./a//b.bin", 3)->size(), 3u);
  EXPECT_EQ(source->read("a/b.bin", 2).error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(source->read("b.bin", 3).error().code, ErrorCode::not_found);
  EXPECT_EQ(source->read("a/../a/b.bin", 3).error().code, ErrorCode::permission_denied);
}

}  // namespace
}  // namespace helio::test
