// Whatever the bytes, decode_tile answers: no crash, no hang, no allocation beyond what max_pixels allows. Run it under
// address and undefined sanitizers.
#include <gtest/gtest.h>

#include <cstring>
#include <iterator>
#include <stdexcept>

#include "tests/support/shared_data.h"
#include "tests/unit/picture/tile_pictures.h"

namespace helio {
namespace {

using test::NoiseTile;
using test::Random;

constexpr std::uint64_t kMaxPixels = 64 * 64;

NoiseTile small_tile() {
  return NoiseTile({32, 16, 59, 49}, 640, 360);
}

// Either outcome is fine; a tile must be within the limit and complete.
void expect_answer(std::span<const std::uint8_t> bytes) {
  const Result<DecodedTile> tile = decode_tile(bytes, kMaxPixels);
  if (!tile) {
    EXPECT_EQ(tile.error().code, ErrorCode::invalid_argument);
    EXPECT_FALSE(tile.error().message.empty());
    return;
  }
  ASSERT_LE(std::uint64_t(tile->header.data_window.area()), kMaxPixels);
  for (const std::vector<float>& channel : tile->channels) {
    ASSERT_EQ(channel.size(), std::size_t(tile->header.data_window.area()));
  }
}

TEST(ExrDamage, EveryTruncationIsRefused) {
  for (const TileCompression compression : test::kCompressions) {
    const std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {TilePixelType::half, compression});
    ASSERT_TRUE(decode_tile(bytes, kMaxPixels).ok());
    for (std::size_t length = 0; length < bytes.size(); length += length < 1200 ? 1 : 97) {
      const std::vector<std::uint8_t> part(bytes.begin(), bytes.begin() + std::ptrdiff_t(length));
      EXPECT_FALSE(decode_tile(part, kMaxPixels).ok()) << length << " of " << bytes.size();
    }
  }
}

TEST(ExrDamage, EveryHeaderByteMayBeAnything) {
  const std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {});
  for (std::size_t i = 0; i < 900; ++i) {
    for (const std::uint8_t value : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      std::vector<std::uint8_t> damaged = bytes;
      damaged[i] = value;
      expect_answer(damaged);
    }
  }
}

TEST(ExrDamage, FlippedBits) {
  Random random(11);
  for (const TileCompression compression : test::kCompressions) {
    const std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {TilePixelType::half, compression});
    for (int round = 0; round < 600; ++round) {
      std::vector<std::uint8_t> damaged = bytes;
      const int flips = 1 << random.next_u32() % 5;
      for (int k = 0; k < flips; ++k) {
        // Half of them in the header and the offset table, where they hurt most.
        const std::size_t range = round % 2 ? damaged.size() : std::min<std::size_t>(1000, damaged.size());
        damaged[random.next_u32() % range] ^= std::uint8_t(1u << random.next_u32() % 8);
      }
      expect_answer(damaged);
    }
  }
}

// Replaces the value of the attribute `name`, which must lie in `bytes`.
void patch(std::vector<std::uint8_t>& bytes, const std::string& name_and_type, std::span<const std::uint8_t> value) {
  const auto at = std::search(bytes.begin(), bytes.end(), name_and_type.begin(), name_and_type.end());
  ASSERT_NE(at, bytes.end());
  std::copy(value.begin(), value.end(), at + std::ptrdiff_t(name_and_type.size()) + 4);
}

std::string name_and_type(const char* name, const char* type) {
  return std::string(name) + '\0' + type + '\0';
}

TEST(ExrDamage, AHugeWindowIsRefusedBeforeItIsAllocated) {
  const std::int32_t windows[][4] = {{0, 0, 2147483646, 2147483646},
                                     {-2147483647 - 1, -2147483647 - 1, 2147483647, 2147483647},
                                     {0, 0, 1 << 28, 1 << 28},
                                     {0, 0, 0, 1 << 28},
                                     {0, 0, 64, 63},
                                     {5, 5, 4, 4}};
  for (const TileCompression compression : test::kCompressions) {
    for (const auto& window : windows) {
      std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {TilePixelType::half, compression});
      std::uint8_t raw[16];
      std::memcpy(raw, window, sizeof(raw));
      patch(bytes, name_and_type("dataWindow", "box2i"), raw);
      const Result<DecodedTile> tile = decode_tile(bytes, kMaxPixels);
      ASSERT_FALSE(tile.ok());
      EXPECT_NE(tile.error().message.find("indow"), std::string::npos) << tile.error().message;
    }
  }
}

TEST(ExrDamage, TheLimitIsExact) {
  const std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {});
  const std::uint64_t area = std::uint64_t(small_tile().header.data_window.area());
  EXPECT_TRUE(decode_tile(bytes, area).ok());
  const Result<DecodedTile> tile = decode_tile(bytes, area - 1);
  ASSERT_FALSE(tile.ok());
  EXPECT_NE(tile.error().message.find("27 x 33 pixels, at most 890"), std::string::npos) << tile.error().message;
}

// Where the table of `chunks` offsets is: the first of them points behind it.
std::size_t find_table(const std::vector<std::uint8_t>& bytes, std::size_t chunks) {
  for (std::size_t at = 8; at + 8 * chunks < bytes.size(); ++at) {
    std::uint64_t offset = 0;
    std::memcpy(&offset, &bytes[at], 8);
    if (offset == at + 8 * chunks) return at;
  }
  throw std::runtime_error("no offset table");
}

// Inserts an attribute as the first of the header, with everything else as it has to be.
std::vector<std::uint8_t> with_attribute(const char* type, std::uint32_t claimed, std::span<const std::uint8_t> value) {
  std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {});
  std::string attribute = name_and_type("extra", type);
  attribute.append(reinterpret_cast<const char*>(&claimed), 4);
  attribute.append(reinterpret_cast<const char*>(value.data()), value.size());
  const std::size_t rows = std::size_t(small_tile().header.data_window.height());
  const std::size_t table = find_table(bytes, rows);
  for (std::size_t row = 0; row < rows; ++row) {
    std::uint64_t offset = 0;
    std::memcpy(&offset, &bytes[table + 8 * row], 8);
    offset += attribute.size();
    std::memcpy(&bytes[table + 8 * row], &offset, 8);
  }
  bytes.insert(bytes.begin() + 8, attribute.begin(), attribute.end());
  return bytes;
}

// OpenEXR 3.1 would allocate what these claim.
TEST(ExrDamage, AttributesThatClaimGigabytes) {
  const std::uint8_t huge[8] = {0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f};
  for (const char* type : {"string", "stringvector", "preview", "floatvector", "unknown", "idmanifest", "chlist"}) {
    EXPECT_FALSE(decode_tile(with_attribute(type, 0x7fffffff, huge), kMaxPixels).ok()) << type;
    EXPECT_FALSE(decode_tile(with_attribute(type, 0xffffffff, huge), kMaxPixels).ok()) << type;
  }
  // An inner size lies, or the type needs another size than is given.
  for (const char* type : {"stringvector", "preview", "idmanifest", "chlist", "int", "box2i", "m44f"}) {
    EXPECT_FALSE(decode_tile(with_attribute(type, sizeof(huge), huge), kMaxPixels).ok()) << type;
  }
  for (const char* type : {"timecode", "string", "somebodysOwn"}) {
    EXPECT_TRUE(decode_tile(with_attribute(type, sizeof(huge), huge), kMaxPixels).ok()) << type;
  }
}

// OpenEXR 3.1 allocates what a DWA chunk's header claims. A smooth picture, so that the chunk is compressed.
TEST(ExrDamage, DwaChunksThatClaimGigabytes) {
  NoiseTile tile({0, 0, 40, 50}, 40, 50);
  for (std::vector<float>& channel : tile.values) std::fill(channel.begin(), channel.end(), 0.5f);
  const std::vector<std::uint8_t> bytes = test::encode_or_die(tile, {TilePixelType::half, TileCompression::dwaa});
  ASSERT_TRUE(decode_tile(bytes, kMaxPixels).ok());
  const std::size_t table = find_table(bytes, 2);
  for (std::size_t word = 1; word <= 9; ++word) {
    std::vector<std::uint8_t> damaged = bytes;
    const std::uint64_t claim = 1'000'000'000;
    std::memcpy(&damaged[table + 16 + 8 + 8 * word], &claim, 8);
    const Result<DecodedTile> decoded = decode_tile(damaged, kMaxPixels);
    ASSERT_FALSE(decoded.ok()) << word;
    EXPECT_NE(decoded.error().message.find("claims more"), std::string::npos) << decoded.error().message;
  }
}

TEST(ExrDamage, OtherKindsOfFileAreNamed) {
  for (const auto& [flag, word] : {std::pair{0x02, "tiled"}, {0x08, "deep"}, {0x10, "parts"}, {0x80, "flags"}}) {
    std::vector<std::uint8_t> bytes = test::encode_or_die(small_tile(), {});
    bytes[5] |= std::uint8_t(flag);
    const Result<DecodedTile> tile = decode_tile(bytes, kMaxPixels);
    ASSERT_FALSE(tile.ok());
    EXPECT_NE(tile.error().message.find(word), std::string::npos) << tile.error().message;
  }
  EXPECT_NE(decode_tile(std::vector<std::uint8_t>{'P', 'N', 'G'}, kMaxPixels).error().message.find("not an EXR"),
            std::string::npos);
  EXPECT_FALSE(decode_tile({}, kMaxPixels).ok());
}

TEST(ExrDamage, TooManyChannels) {
  std::vector<std::string> names;
  for (int i = 0; i < 65; ++i) names.push_back("channel." + std::to_string(i));
  const NoiseTile tile({0, 0, 1, 1}, 1, 1, names);
  const Result<DecodedTile> decoded = decode_tile(test::encode_or_die(tile, {}), kMaxPixels);
  ASSERT_FALSE(decoded.ok());
  EXPECT_NE(decoded.error().message.find("65 channels, 1 to 64"), std::string::npos) << decoded.error().message;
}

TEST(ExrDamage, TheBrokenPicturesOfOthers) {
  HELIO_SHARED_OR_SKIP(root, "scenes/images-malformed");
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file()) continue;
    const std::vector<std::uint8_t> bytes = test::read_bytes(entry.path());
    SCOPED_TRACE(entry.path().filename().string());
    expect_answer(bytes);
    if (bytes.size() > 4 && bytes[0] == 0x76 && bytes[1] == 0x2f) ++files;
  }
  EXPECT_GT(files, 0) << "no EXR file found: the test checked nothing";
}

}  // namespace
}  // namespace helio
