#include "server/state/sealed_message.h"

#include <gtest/gtest.h>

#include "renderer/codec/checksum.h"
#include "server/jobs/checkpoint_header.h"
#include "server/jobs/checkpoint_header.pb.h"

namespace helio::test {
namespace {

using Message = heliograph::kept::CheckpointHeader;

// A record with this content, which need be no message.
std::string sealed(const std::string& content, char version = 2) {
  std::string bytes = std::string{version, 0, 0, 0} + content;
  const std::uint32_t sum = crc32_of(bytes.data(), bytes.size());
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(char(sum >> shift));
  return bytes;
}

std::string told_of(const std::string& bytes) {
  Message message;
  const Status read = unseal(bytes, 2, message);
  return read.ok() ? "" : read.error().to_string();
}

TEST(SealedMessage, LiesBetweenVersionAndChecksum) {
  Message message;
  message.set_view(5);
  const auto bytes = seal(message, 2);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), sealed("\x08\x05"));  // field 1, a number: 5
  Message read;
  ASSERT_TRUE(unseal(bytes, 2, read).ok());
  EXPECT_EQ(read.view(), 5u);
  EXPECT_EQ(told_of(sealed("")), "");  // all fields have their zeroes
}

TEST(SealedMessage, TellsVersionsFromDamage) {
  EXPECT_EQ(told_of(sealed("", 3)), "has version 3; this program reads version 2");
  EXPECT_EQ(told_of(sealed("", 0)), "has version 0; this program reads version 2");
  EXPECT_EQ(told_of(R"({"view":0})"), "has version 1; this program reads version 2");
  EXPECT_EQ(told_of("\xbf"), "has version 1; this program reads version 2");  // a map of CBOR
  std::string flipped = sealed("\x08\x05", 3);
  flipped[4] ^= 1;
  EXPECT_EQ(told_of(flipped), "is damaged: its checksum is another");
  EXPECT_EQ(told_of(""), "is damaged: it has 0 bytes");
  EXPECT_EQ(told_of(std::string(7, 2)), "is damaged: it has 7 bytes");
}

// Lengths that the bytes do not have: of 2 GiB less one, of more than a number holds, and inside of nothing.
TEST(SealedMessage, BelievesNoLength) {
  for (const char* length : {"\xff\xff\xff\xff\x07", "\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01", "\x01"}) {
    EXPECT_EQ(told_of(sealed(std::string("\x12") + length)), "is damaged: its message cannot be read");
  }
}

TEST(CheckpointHeader, ComesBackAsItWas) {
  CheckpointHeader header{3, "a build", false, std::string("\0an \xff end", 9), std::string("\0\xff", 2)};
  header.time_s = 1764359000.25;
  for (const bool done : {true, false}) {
    if (!done) header.frame_end.reset();
    const auto read = CheckpointHeader::read(header.write());
    ASSERT_TRUE(read.ok()) << read.error().to_string();
    EXPECT_EQ(read->view, 3u);
    EXPECT_EQ(read->build, "a build");
    EXPECT_FALSE(read->same_bits);
    EXPECT_EQ(read->frame_end, header.frame_end);
    EXPECT_EQ(read->progress, header.progress);
    EXPECT_EQ(read->time_s, header.time_s);
  }
  header.frame_end = "";
  EXPECT_EQ(CheckpointHeader::read(header.write())->frame_end, "");
}

TEST(CheckpointHeader, RefusesEveryCutAndTellsTheVersion) {
  const std::string whole = CheckpointHeader{3, "a build", true, std::nullopt}.write();
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(CheckpointHeader::read(whole.substr(0, size)).ok()) << size;
  const auto old = CheckpointHeader::read(R"({"build":"a build","same_bits":true,"view":3})");
  ASSERT_FALSE(old.ok());
  EXPECT_EQ(old.error().to_string(), "its header has version 1; this program reads version 2");
}

}  // namespace
}  // namespace helio::test
