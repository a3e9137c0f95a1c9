// Parts made of a whole picture by hand: what they are merged to is known.
#include "client/shards/picture_merge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "client/shards/picture_origin.h"
#include "renderer/codec/atomic_file.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;

constexpr int kWidth = 5, kHeight = 97;

// A value of its own for each pixel and channel.
float value(int channel, int x, int y) {
  return float(channel * 100000 + y * 100 + x) + 0.25f;
}

class PictureMerge : public testing::Test {
 protected:
  PictureMerge() {
    origin_.set_scene_id("abc");
    origin_.mutable_settings()->set_width(kWidth);
    origin_.mutable_settings()->set_height(kHeight);
    origin_.mutable_settings()->set_seed((std::uint64_t(1) << 63) + 1);  // no double has it
    origin_.mutable_budget()->set_samples(16);
    origin_.set_samples_per_pixel(16);
    origin_.set_ended_by(pb::END_REASON_SAMPLES);
    origin_.set_build("g++");
    origin_.set_isa("avx2");
  }

  PicturePart part(const Shard& shard) const {
    const RowRange rows = rendered_rows(shard, kHeight);
    PicturePart made;
    made.file = "part" + std::to_string(shard.number) + "of" + std::to_string(shard.count) + ".exr";
    made.origin = origin_;
    pb::Rect& region = *made.origin.mutable_settings()->mutable_region();
    region.set_x1(kWidth);
    region.set_y0(rows.first);
    region.set_y1(rows.end);
    made.picture.header = {{0, rows.first, kWidth, rows.end}, kWidth, kHeight, "comment", write_origin(made.origin)};
    made.picture.names = {"G", "samples", "variance.G"};
    for (int channel = 0; channel < 3; ++channel) {
      std::vector<float>& plane = made.picture.channels.emplace_back();
      for (int y = rows.first; y < rows.end; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          // The variance at a part's edges is another one: what it is made of ends there.
          const bool edge = (y < rows.first + 3 && rows.first > 0) || (y >= rows.end - 3 && rows.end < kHeight);
          plane.push_back(channel == 2 && edge ? -1 : value(channel, x, y));
        }
      }
    }
    return made;
  }
  std::vector<PicturePart> parts(int count) const {
    std::vector<PicturePart> all;
    for (int number = 1; number <= count; ++number) all.push_back(part({number, count}));
    return all;
  }
  // The message of the refusal.
  static std::string refusal(std::vector<PicturePart> parts, const MergeOptions& options = {}) {
    const auto merged = merge_parts(std::move(parts), options);
    EXPECT_FALSE(merged);
    return merged ? "" : merged.error().to_string();
  }

  pb::PictureOrigin origin_;
};

TEST_F(PictureMerge, GivesTheWholeInAnyOrderAndNumberOfParts) {
  for (int count = 1; count <= most_shards(kHeight); ++count) {
    auto all = parts(count);
    std::rotate(all.begin(), all.begin() + count / 2, all.end());
    const auto merged = merge_parts(std::move(all));
    ASSERT_TRUE(merged) << merged.error().to_string();
    const DecodedTile& whole = merged->picture;
    EXPECT_EQ(whole.header.data_window, (PixelRect{0, 0, kWidth, kHeight}));
    EXPECT_EQ(whole.header.comments, "comment");
    EXPECT_EQ(whole.header.origin, write_origin(origin_));  // as if nobody had cut it
    EXPECT_EQ(merged->shards.front(), (Shard{1, count}));
    EXPECT_EQ(merged->files.back(), "part" + std::to_string(count) + "of" + std::to_string(count) + ".exr");
    for (int channel = 0; channel < 3; ++channel) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x)
          ASSERT_EQ(whole.channels[std::size_t(channel)][std::size_t(y * kWidth + x)], value(channel, x, y))
              << channel << ": " << x << "," << y << " of " << count;
      }
    }
  }
}

// Both halves of 32 rows have all of them, with their margins: nothing but their number tells them apart.
TEST_F(PictureMerge, HalvesOfTwoBlocksAreTwoParts) {
  constexpr int kRows = 32;
  PicturePart half;
  half.origin = origin_;
  half.origin.mutable_settings()->set_height(kRows);
  half.picture.header = {{0, 0, kWidth, kRows}, kWidth, kRows};
  half.picture.names = {"G"};
  half.picture.channels = {std::vector<float>(kWidth * kRows, 7.0f)};
  const auto merged = merge_parts({half, half});
  ASSERT_TRUE(merged) << merged.error().to_string();
  EXPECT_EQ(merged->shards, (std::vector<Shard>{{1, 2}, {2, 2}}));
  EXPECT_EQ(merged->picture.channels, half.picture.channels);
}

TEST_F(PictureMerge, NamesMissingAndRepeatedParts) {
  auto all = parts(4);  // rows from 0, 16, 48, 80: 7 blocks of rows
  all.erase(all.begin() + 2);
  EXPECT_EQ(refusal(all), "part 3/4: is missing: rows [48, 80)");
  all.push_back(part({2, 4}));
  const std::string both = refusal(all);
  EXPECT_NE(both.find("has the same rows as part2of4.exr: both are part 2/4"), std::string::npos) << both;
  EXPECT_NE(both.find("part 3/4: is missing"), std::string::npos) << both;
  EXPECT_NE(refusal({part({1, 2}), part({3, 3})}).find("are not the parts of one division of 97 rows"),
            std::string::npos);
  EXPECT_EQ(refusal({}), "PART.exr: none is given");
}

TEST_F(PictureMerge, NamesWhatDiffers) {
  const struct {
    std::function<void(PicturePart&)> change;
    std::string named;
    bool mixed = false;  // --mix takes it
  } cases[] = {
      {[](PicturePart& p) { p.origin.set_scene_id("def"); }, "scene_id"},
      {[](PicturePart& p) { p.origin.mutable_settings()->set_seed(7); }, "settings.seed"},
      {[](PicturePart& p) { p.origin.mutable_settings()->set_max_segments(7); }, "settings.max_segments"},
      {[](PicturePart& p) { p.origin.mutable_camera()->set_vertical_fov(1); }, "camera"},
      {[](PicturePart& p) { p.origin.mutable_budget()->set_samples(32); }, "budget.samples"},
      {[](PicturePart& p) { p.origin.set_samples_per_pixel(8); }, "samples_per_pixel"},
      {[](PicturePart& p) { p.origin.set_build("clang"); }, "build", true},
      {[](PicturePart& p) { p.origin.set_isa("sse2"); }, "isa", true},
      {[](PicturePart& p) { p.origin.set_mixed_builds(true); }, "different builds", true},
      {[](PicturePart& p) { p.origin.set_ended_by(pb::END_REASON_CANCELLED); }, "not rendered to its end"},
      {[](PicturePart& p) { p.origin.mutable_settings()->set_mode(pb::MODE_ADAPTIVE); }, "--mode pt"},
      {[](PicturePart& p) { p.origin.mutable_budget()->set_error(1); }, "--samples"},
      {[](PicturePart& p) { p.picture.names[0] = "B"; }, "other channels"},
      {[](PicturePart& p) { p.picture.names[0] = "display.G"; }, "display.G"},
      {[](PicturePart& p) { p.picture.header.comments = ""; }, "another comment"},
      {[](PicturePart& p) { p.picture.header.frame_height = 98; }, "5x98"},
  };
  for (const auto& one : cases) {
    auto all = parts(2);
    one.change(all[1]);
    const std::string message = refusal(all);
    EXPECT_NE(message.find(one.named), std::string::npos) << message;
    EXPECT_NE(message.find("part2of2.exr"), std::string::npos) << message;
    const auto merged = merge_parts(all, {.mix = true});
    EXPECT_EQ(merged.ok(), one.mixed) << one.named;
    if (merged) {
      EXPECT_TRUE(merged->origin.mixed_builds());
    }
  }
}

// Margins are what two parts have in common: a part of another program, or a file that was changed, shows there.
TEST_F(PictureMerge, NamesThePixelThatTwoPartsHaveAndThatDiffers) {
  auto all = parts(2);  // rows [0, 48) and [48, 97); both have [32, 64)
  EXPECT_EQ(merge_parts(all)->checked_rows, 32);
  all[1].picture.channels[0][std::size_t((40 - 32) * kWidth + 3)] += 1;
  const std::string message = refusal(all);
  EXPECT_NE(message.find("part1of2.exr: and part2of2.exr differ at pixel (3, 40) of G"), std::string::npos) << message;
  EXPECT_TRUE(merge_parts(all, {.mix = true}));
}

TEST_F(PictureMerge, AFileThatDoesNotSayHowItWasMadeIsRefused) {
  const PicturePart made = part({1, 2});
  const std::string file = testing::TempDir() + "/part.exr";
  for (const std::string& origin : {std::string(), std::string("{\"seed\":"), made.picture.header.origin}) {
    TileHeader header = made.picture.header;
    header.origin = origin;
    const TileChannel channel{"G", made.picture.channels[0].data(), true};
    const auto bytes = encode_tile(header, {&channel, 1}, {TilePixelType::float32, TileCompression::zip});
    ASSERT_TRUE(bytes) << bytes.error().to_string();
    ASSERT_TRUE(write_file_atomically(file, *bytes));
    const auto read = read_part(file);
    EXPECT_EQ(read.ok(), origin == made.picture.header.origin);
    if (!read) {
      EXPECT_NE(read.error().to_string().find(file + ": attribute heliograph.render: "), std::string::npos)
          << read.error().to_string();
    }
  }
  EXPECT_EQ(read_part(file)->origin.settings().seed(), (std::uint64_t(1) << 63) + 1);
  std::filesystem::remove(file);
  EXPECT_EQ(read_part(file).error().code, ErrorCode::not_found);
}

// Newer versions may say more.
TEST(PictureOrigin, FieldsThatAreNotKnownAreIgnored) {
  const auto origin = read_origin(R"({"scene_id": "abc", "weather": {"rain": 1}})");
  ASSERT_TRUE(origin) << origin.error().to_string();
  EXPECT_EQ(origin->scene_id(), "abc");
}

}  // namespace
}  // namespace helio::test
