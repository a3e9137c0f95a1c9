// Pictures whose errors are known by hand, as the record and the files of a comparison.
#include "tests/bench/reports/comparison_record.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/comparison/comparison_folder.h"
#include "client/comparison/comparison_record.h"

namespace helio::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kSize = 16;
constexpr double kVariance = 0.01;  // of each value of the reference

LoopPicture picture_of(float value) {
  LoopPicture picture;
  picture.width = picture.height = kSize;
  for (auto& channel : picture.channels) channel.assign(kSize * kSize, value);
  return picture;
}

class RecordedComparisonTest : public ::testing::Test {
 protected:
  RecordedComparisonTest() {
    std::string pattern = (fs::temp_directory_path() / "helio_record.XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    scene_.name = "box";
    scene_.file = "/scenes/box.xml";
    scene_.reference_file = folder_ / "reference.exr";
    std::ofstream(scene_.reference_file) << "any bytes";
    scene_.reference = picture_of(1);
    scene_.reference_variance = picture_of(float(kVariance));
    options_.seeds = 5;
    options_.threads = 1;
    options_.command_line = "helio_bench peers box";
  }
  ~RecordedComparisonTest() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  // Errors of pt are `off` at one sample and half of that at four, in all channels, with times of 1 and 4 seconds; the
  // other renderer is half as far off in the same time.
  Result<pb::CompareRecord> record(float off = 0.5f) {
    RecordedComparison comparison("box", scene_, {{"pt", RenderSettings()}, {"other-1.0", std::nullopt}}, {1, 4},
                                  options_);
    for (int seed = options_.seeds; seed >= 1; --seed) {
      for (std::size_t count = 0; count < 2; ++count) {
        const float value = count == 0 ? off : off / 2;
        for (const auto& [mode, far] : {std::pair("pt", value), std::pair("other-1.0", value / 2)}) {
          const LoopPicture picture = picture_of(1 + far);
          if (const Status added = comparison.add(mode, seed, count, picture.view(), count == 0 ? 1 : 4); !added)
            return added.error();
        }
      }
    }
    return comparison.finish();
  }

  ErrorScene scene_;
  BenchOptions options_;
  fs::path folder_;
};

const pb::ComparePoint::Value* find(const pb::CompareRecord& record, const std::string& mode, std::uint32_t budget,
                                    pb::CompareMeasure measure) {
  for (const pb::ComparePoint& point : record.table().points()) {
    if (point.mode() != mode || point.budget() != budget) continue;
    for (const auto& value : point.values()) {
      if (value.measure() == measure && value.region().empty()) return &value;
    }
  }
  return nullptr;
}

TEST_F(RecordedComparisonTest, HoldsErrorsWithoutTheReferencesNoise) {
  const auto made = record();
  ASSERT_TRUE(made) << made.error().to_string();
  EXPECT_EQ(made->units_size(), 2 * 2 * 5);
  EXPECT_EQ(made->units(0).seed_number(), 1u);  // sorted, whatever order they came in
  const auto* mse = find(*made, "pt", 0, pb::COMPARE_MEASURE_MSE);
  ASSERT_TRUE(mse);
  EXPECT_NEAR(mse->value().mean(), 0.25 - kVariance, 1e-6);
  EXPECT_TRUE(mse->value().known());
  EXPECT_NEAR(find(*made, "pt", 0, pb::COMPARE_MEASURE_BIAS)->value().mean(), 0.5, 1e-6);
  EXPECT_NEAR(find(*made, "other-1.0", 1, pb::COMPARE_MEASURE_MSE)->value().mean(), 0.125 * 0.125 - kVariance, 1e-6);
  // relMSE: mean(r)^2 is 1, so that the denominator is 1.01.
  EXPECT_NEAR(find(*made, "pt", 1, pb::COMPARE_MEASURE_RELMSE)->value().mean(), (0.0625 - kVariance) / 1.01, 1e-6);
  ASSERT_EQ(made->references_size(), 1);
  EXPECT_EQ(made->references(0).noise(), pb::CompareResponse::Reference::NOISE_VARIANCE);
  EXPECT_NEAR(made->references(0).error(), std::sqrt(kVariance / 1.01), 1e-6);
}

TEST_F(RecordedComparisonTest, WithoutVarianceTheNoiseStaysInTheErrors) {
  scene_.reference_variance = picture_of(0);
  const auto made = record();
  ASSERT_TRUE(made) << made.error().to_string();
  EXPECT_NEAR(find(*made, "pt", 0, pb::COMPARE_MEASURE_MSE)->value().mean(), 0.25, 1e-6);
  EXPECT_EQ(made->references(0).noise(), pb::CompareResponse::Reference::NOISE_UNSPECIFIED);
  EXPECT_EQ(made->references(0).error(), 0);
}

TEST_F(RecordedComparisonTest, ComparesModesAtEqualTime) {
  scene_.reference_variance = picture_of(0);
  const auto made = record();
  ASSERT_TRUE(made) << made.error().to_string();
  int found = 0;
  for (const pb::CompareRatio& ratio : made->table().ratios()) {
    if (ratio.kind() != pb::CompareRatio::KIND_EQUAL_TIME || ratio.measure() != pb::COMPARE_MEASURE_MSE ||
        !ratio.region().empty())
      continue;
    ++found;
    EXPECT_EQ(ratio.mode(), "other-1.0");
    EXPECT_EQ(ratio.baseline(), "pt");
    EXPECT_NEAR(ratio.ratio().mean(), 0.25, 1e-6) << ratio.at();
    EXPECT_EQ(ratio.verdict(), pb::COMPARE_VERDICT_BETTER);
  }
  EXPECT_GT(found, 0);
}

TEST_F(RecordedComparisonTest, RefusesPicturesAndReferencesThatCannotBeMeasured) {
  const auto not_finite = record(std::numeric_limits<float>::infinity());
  ASSERT_FALSE(not_finite);
  EXPECT_EQ(not_finite.error().code, ErrorCode::invalid_argument);
  fs::remove(scene_.reference_file);
  const auto without_file = record();
  ASSERT_FALSE(without_file);
  EXPECT_EQ(without_file.error().code, ErrorCode::not_found);
}

TEST_F(RecordedComparisonTest, IsPublishedAsAFolderOfHeliographCompare) {
  const auto made = record();
  ASSERT_TRUE(made) << made.error().to_string();
  ::testing::internal::CaptureStdout();
  const Status published = publish_comparisons({*made, *made}, true, folder_.string());
  const auto json = nlohmann::json::parse(::testing::internal::GetCapturedStdout());
  ASSERT_TRUE(published) << published.error().to_string();
  ASSERT_EQ(json.at("comparisons").size(), 2u);
  const auto& only = json["comparisons"][0];
  EXPECT_EQ(only.at("name"), "box");
  EXPECT_EQ(only.at("modes"), nlohmann::json({"pt", "other-1.0"}));
  EXPECT_EQ(only.at("points").size(), 4u);
  const auto read = read_comparison_folder(folder_ / "box");
  ASSERT_TRUE(read) << read.error().to_string();
  ASSERT_TRUE(*read);
  EXPECT_EQ((*read)->units_size(), made->units_size());
  EXPECT_EQ((*read)->calls(0).command_line(), "helio_bench peers box");
  for (const char* name : {"comparison.json", "units.csv", "points.csv", "ratios.csv", "report.html"}) {
    EXPECT_GT(fs::file_size(folder_ / "box" / name), 100u) << name;
    EXPECT_EQ(fs::file_size(folder_ / "box-2" / name), fs::file_size(folder_ / "box" / name)) << name;
  }
  std::ostringstream page;
  page << std::ifstream(folder_ / "box/report.html").rdbuf();
  EXPECT_NE(page.str().find("other-1.0"), std::string::npos);
}

}  // namespace
}  // namespace helio::bench
