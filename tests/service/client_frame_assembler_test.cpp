#include <gtest/gtest.h>

#include "client/frame_assembler.h"
#include "client_tile.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;
using Outcome = FrameAssembler::Outcome;

constexpr int kWidth = 6, kHeight = 4;
constexpr PixelRect kLeft{0, 0, 4, 4}, kRight{4, 0, 6, 4};

pb::FrameBegin frame(std::uint64_t revision) {
  pb::FrameBegin begin;
  begin.mutable_tag()->set_revision(revision);
  begin.mutable_settings()->set_width(kWidth);
  begin.mutable_settings()->set_height(kHeight);
  return begin;
}

// The error's sentence, or what was returned instead of one.
std::string refusal(FrameAssembler& assembler, pb::Tile tile) {
  const auto added = assembler.add(std::move(tile));
  return added ? "taken" : added.error().to_string();
}

TEST(FrameAssembler, PutsTilesWhereTheyBelong) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  ASSERT_TRUE(assembler.add(make_tile(kLeft, kWidth, kHeight, 2)));
  EXPECT_FALSE(assembler.complete());
  ASSERT_TRUE(assembler.add(make_tile(kRight, kWidth, kHeight, 3)));
  EXPECT_TRUE(assembler.complete());
  const auto picture = assembler.picture();
  ASSERT_TRUE(picture) << picture.error().to_string();
  const std::vector<float>* red = (*picture)->find("R");
  ASSERT_TRUE(red);
  ASSERT_EQ(red->size(), std::size_t(kWidth * kHeight));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ((*red)[y * kWidth + x], x < 4 ? 2 : 3) << x << "," << y;
  }
}

TEST(FrameAssembler, ShowsTheNewestPassOfATile) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  ASSERT_TRUE(assembler.add(make_tile(kLeft, kWidth, kHeight, 2, 1, 0)));
  ASSERT_TRUE(assembler.picture());
  ASSERT_TRUE(assembler.add(make_tile(kLeft, kWidth, kHeight, 5, 1, 2)));
  const auto old = assembler.add(make_tile(kLeft, kWidth, kHeight, 3, 1, 1));
  ASSERT_TRUE(old);
  EXPECT_EQ(*old, Outcome::stale);
  EXPECT_EQ((*(*assembler.picture())->find("G"))[0], 5);
  EXPECT_EQ(assembler.stale_tiles(), 1u);
}

TEST(FrameAssembler, IgnoresOlderRevisionsAndRefusesUnknownOnes) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(7)));
  const auto old = assembler.add(make_tile(kLeft, kWidth, kHeight, 2, 6));
  ASSERT_TRUE(old);
  EXPECT_EQ(*old, Outcome::stale);
  EXPECT_NE(refusal(assembler, make_tile(kLeft, kWidth, kHeight, 2, 8)).find("revision 8"), std::string::npos);
  EXPECT_TRUE((*assembler.picture())->empty());
}

TEST(FrameAssembler, RefusesOneFlippedBit) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  pb::Tile tile = make_tile(kLeft, kWidth, kHeight, 2);
  (*tile.mutable_exr())[tile.exr().size() / 2] ^= 4;
  EXPECT_NE(refusal(assembler, tile).find("checksum"), std::string::npos);
  EXPECT_FALSE(assembler.complete());
}

TEST(FrameAssembler, RefusesWindowsThatDoNotFit) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  EXPECT_NE(refusal(assembler, make_tile({4, 0, 8, 4}, 8, 4, 1)).find("outside the region"), std::string::npos);
  ASSERT_TRUE(assembler.add(make_tile(kLeft, kWidth, kHeight, 2)));
  EXPECT_NE(refusal(assembler, make_tile({2, 0, 6, 4}, kWidth, kHeight, 1)).find("overlaps"), std::string::npos);
  pb::Tile empty = make_tile(kRight, kWidth, kHeight, 1);
  empty.mutable_window()->set_x1(4);
  EXPECT_NE(refusal(assembler, empty).find("outside the region"), std::string::npos);
}

TEST(FrameAssembler, RefusesAnExrThatIsNotTheAnnouncedWindow) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  pb::Tile tile = make_tile({0, 0, 2, 4}, kWidth, kHeight, 1);
  tile.mutable_window()->set_x0(4);
  tile.mutable_window()->set_x1(6);
  ASSERT_TRUE(assembler.add(tile));  // the bytes are looked at when the picture is wanted
  const auto picture = assembler.picture();
  ASSERT_FALSE(picture);
  EXPECT_NE(picture.error().to_string().find("[0, 2)"), std::string::npos) << picture.error().to_string();

  ASSERT_TRUE(assembler.begin(frame(1)));
  pb::Tile text = make_tile(kLeft, kWidth, kHeight, 1);
  text.set_exr("not an EXR");
  text.set_crc32(crc32_of(text.exr()));
  ASSERT_TRUE(assembler.add(text));
  EXPECT_FALSE(assembler.picture());
}

TEST(FrameAssembler, RefusesFramesThatCannotBe) {
  for (const auto& [width, height] : {std::pair(0, 4), std::pair(4, -1), std::pair(1 << 30, 1 << 30)}) {
    pb::RenderSettings settings;
    settings.set_width(width);
    settings.set_height(height);
    FrameAssembler assembler;
    EXPECT_FALSE(assembler.begin(settings)) << width << "x" << height;
  }
  pb::RenderSettings settings = frame(1).settings();
  settings.mutable_region()->set_x1(kWidth + 1);
  settings.mutable_region()->set_y1(1);
  FrameAssembler assembler;
  EXPECT_FALSE(assembler.begin(settings));
  EXPECT_NE(refusal(assembler, make_tile(kLeft, kWidth, kHeight, 1)).find("before its frame"), std::string::npos);
}

TEST(FrameAssembler, CoversTheRegionOnly) {
  pb::RenderSettings settings = frame(1).settings();
  settings.mutable_region()->set_x0(1);
  settings.mutable_region()->set_y0(1);
  settings.mutable_region()->set_x1(3);
  settings.mutable_region()->set_y1(2);
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(settings));
  ASSERT_TRUE(assembler.add(make_tile({1, 1, 3, 2}, kWidth, kHeight, 4, 9)));
  EXPECT_TRUE(assembler.complete());
  EXPECT_EQ((*assembler.picture())->find("B")->size(), 2u);
}

TEST(FrameAssembler, FilmAndPreviewNeverMix) {
  FrameAssembler assembler;
  ASSERT_TRUE(assembler.begin(frame(1)));
  pb::Tile tile = make_tile(kLeft, kWidth, kHeight, 2);
  tile.set_preview(true);
  EXPECT_NE(refusal(assembler, tile).find("a preview's, where the film is shown"), std::string::npos);
  EXPECT_EQ(assembler.tiles(), 0u);

  pb::FrameBegin preview = frame(1);
  preview.set_preview(true);
  ASSERT_TRUE(assembler.begin(preview));
  EXPECT_TRUE(assembler.add(tile));
  tile.set_preview(false);
  EXPECT_NE(refusal(assembler, tile).find("the film's, where a preview is shown"), std::string::npos);
  ASSERT_TRUE(assembler.begin(frame(1)));
  EXPECT_TRUE(assembler.add(tile)) << "the film's frame of the same revision";
}

TEST(FrameAssembler, RefusesJpeg) {
  FrameAssembler assembler;
  pb::FrameBegin preview = frame(1);
  preview.set_preview(true);
  ASSERT_TRUE(assembler.begin(preview));
  pb::Tile tile = make_tile(kLeft, kWidth, kHeight, 2);
  tile.set_preview(true);
  tile.mutable_exr()->swap(*tile.mutable_jpeg());
  EXPECT_NE(refusal(assembler, tile).find("is a JPEG"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
