#include "client/shards/shard.h"

#include <gtest/gtest.h>

namespace helio::test {
namespace {

namespace pb = heliograph::v1;

TEST(Shard, IsReadAsItIsWritten) {
  const auto shard = parse_shard("2/4");
  ASSERT_TRUE(shard);
  EXPECT_EQ(*shard, (Shard{2, 4}));
  EXPECT_EQ(to_string(*shard), "2/4");
  EXPECT_TRUE(parse_shard("1/1"));
  EXPECT_TRUE(parse_shard("4096/4096"));
}

TEST(Shard, RefusesWhatIsNone) {
  for (const char* text : {"", "1", "/", "1/", "/2", "0/4", "5/4", "-1/4", "1/0", "1/4097", "1/4 ", " 1/4", "1/4/4",
                           "a/4", "1.5/4", "99999999999/4"}) {
    const auto shard = parse_shard(text);
    ASSERT_FALSE(shard) << text;
    EXPECT_NE(shard.error().message.find("'" + std::string(text) + "'"), std::string::npos) << shard.error().message;
    EXPECT_NE(shard.error().message.find("[1, 4096]"), std::string::npos);
  }
}

// Every row once, at blocks of 16 rows, in as many parts as there are blocks.
TEST(Shard, PartsHaveEachRowOnce) {
  for (const int height : {1, 15, 16, 17, 97, 720, 1080}) {
    EXPECT_EQ(most_shards(height), (height + 15) / 16);
    for (int count = 1; count <= most_shards(height); ++count) {
      int row = 0;
      for (int number = 1; number <= count; ++number) {
        const RowRange own = rows_of({number, count}, height), rendered = rendered_rows({number, count}, height);
        EXPECT_EQ(own.first, row);
        EXPECT_EQ(own.first % 16, 0);
        EXPECT_GT(own.end, own.first) << height << ": " << number << "/" << count;
        EXPECT_EQ(rendered.first, std::max(0, own.first - 16));
        EXPECT_EQ(rendered.end, std::min(height, own.end + 16));
        row = own.end;
      }
      EXPECT_EQ(row, height);
    }
  }
  EXPECT_EQ(most_shards(65536 * 2), kMostShards);
}

TEST(Shard, SettingsThatDependOnTheWholePictureSayWhy) {
  pb::RenderSettings settings;
  pb::Budget budget;
  budget.set_samples(16);
  EXPECT_EQ(no_shards_reason(settings, budget), "");
  settings.set_mode(pb::MODE_PT);
  settings.set_integrator(pb::INTEGRATOR_PATH);
  settings.set_device("cpu");
  EXPECT_EQ(no_shards_reason(settings, budget), "");

  const auto reason = [&](const auto& change) {
    pb::RenderSettings other = settings;
    pb::Budget of = budget;
    change(other, of);
    return no_shards_reason(other, of);
  };
  using Settings = pb::RenderSettings;
  using Budget = pb::Budget;
  EXPECT_NE(reason([](Settings& s, Budget&) { s.set_mode(pb::MODE_ADAPTIVE); }).find("--mode pt"), std::string::npos);
  EXPECT_NE(reason([](Settings& s, Budget&) { s.set_integrator(pb::INTEGRATOR_BDPT); }).find("--integrator path"),
            std::string::npos);
  EXPECT_NE(reason([](Settings& s, Budget&) { s.set_device("vulkan"); }).find("--device cpu"), std::string::npos);
  EXPECT_NE(reason([](Settings&, Budget& b) { b.clear_samples(); }).find("--samples"), std::string::npos);
  EXPECT_NE(reason([](Settings&, Budget& b) { b.set_time_s(1); }).find("--samples"), std::string::npos);
  EXPECT_NE(reason([](Settings&, Budget& b) { b.set_error(1); }).find("--samples"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
