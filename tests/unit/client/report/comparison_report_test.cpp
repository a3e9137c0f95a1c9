#include "client/report/comparison_report.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <regex>
#include <set>

#include "tests/unit/client/report/made_up_record.h"

namespace helio::report {
namespace {

namespace fs = std::filesystem;
namespace pb = heliograph::v1;

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

fs::path nowhere() {
  return fs::path(testing::TempDir()) / "no-such-comparison";
}

// Without script and style, whose text is not the record's.
std::string body_of(const std::string& html) {
  const std::size_t begin = html.find("<main>"), end = html.rfind("</main>");
  return begin == std::string::npos || end == std::string::npos ? std::string() : html.substr(begin, end - begin);
}

// From the element with that id to the next element of the same kind.
std::string section_of(const std::string& html, const std::string& id) {
  const std::size_t begin = html.find("<section id=\"" + id + "\"");
  if (begin == std::string::npos) return {};
  const std::size_t end = html.find("<section id=", begin + 1);
  return html.substr(begin, end == std::string::npos ? end : end - begin);
}

class ReportFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("report-" + std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST(ComparisonReport, TellsSentencesPointsAndRatios) {
  const std::string html = body_of(comparison_report(made_up_record({}), nowhere()));
  EXPECT_NE(html.find("adaptive reaches the relative MSE of pt in half of the time (2.0, 1.8 to 2.2).</p>\n<ul "
                      "class=\"sentences\"><li>bdpt takes longer"),
            std::string::npos);
  // relMSE of pt at 8 samples: 1 / 2^3, with 10 % to either side.
  EXPECT_NE(html.find("<td>0.125<br>[0.113, 0.138]"), std::string::npos);
  EXPECT_EQ(count_of(html, "<section class=\"part\""), 6);  // three measures, of the picture and of its dark half
  EXPECT_NE(html.find("8192 samples per pixel, root of its own relative MSE 0.00980"), std::string::npos);
  EXPECT_NE(html.find("two independent halves and taken off MSE"), std::string::npos);
  for (const char* fact : {"Release, GCC 12.2", "avx2", "8 threads", "scene-4f2a", "reference-0",
                           "heliograph compare scenes/", "settings.max_segments", "MODE_ADAPTIVE", "roulette_from"}) {
    EXPECT_NE(html.find(fact), std::string::npos) << fact;
  }
  EXPECT_EQ(count_of(html, "nan") + count_of(html, ">inf"), 0);
}

TEST(ComparisonReport, TellsLossesAsPlainlyAsWins) {
  const std::string html =
      section_of(comparison_report(made_up_record({{"pt", "adaptive", "bdpt", "lvc"}}), nowhere()), "answer");
  // Each mode has four: at equal error, time and samples, and speed.
  EXPECT_EQ(count_of(html, "<td class=b>▲ better\n"), 4);
  EXPECT_EQ(count_of(html, "<td class=w>▼ worse\n"), 4);
  EXPECT_EQ(count_of(html, "<td class=u>◇ undecided\n"), 4);
  // To the smallest error: bdpt takes 1 / 0.625 as long.
  EXPECT_NE(html.find("to a relative MSE of 0.0156<td class=\"ratio\">0.625&#8239;×<td class=\"ratio\">[0.562, 0.688]"),
            std::string::npos);
}

TEST(ComparisonReport, HasNoIntervalsBelowFiveSeedsAndSaysWhy) {
  RecordShape shape;
  shape.seeds = 4;
  const std::string html = body_of(comparison_report(made_up_record(shape), nowhere()));
  EXPECT_EQ(count_of(html, "class=\"band\""), 0);
  EXPECT_EQ(count_of(html, "<br>[") + count_of(html, "<i>["), 0);
  EXPECT_NE(html.find("a: no interval, because there are fewer than five seeds."), std::string::npos);
  EXPECT_NE(html.find("Few seeds."), std::string::npos);
  const std::string enough = body_of(comparison_report(made_up_record({}), nowhere()));
  EXPECT_EQ(count_of(enough, "class=\"band\""), 6 * 2 * 3);  // parts, panels, modes
  EXPECT_EQ(count_of(enough, "fewer than five seeds."), 0);
}

TEST(ComparisonReport, SaysThatSeedsAllowNoInterval) {
  pb::CompareRecord record = made_up_record({});
  for (auto& point : *record.mutable_table()->mutable_points()) {
    for (auto& value : *point.mutable_values()) value.mutable_value()->set_known(false);
  }
  const std::string html = comparison_report(record, nowhere());
  EXPECT_EQ(count_of(html, "b: no interval, because the seeds that are there do not allow one."), 6);
}

TEST(ComparisonReport, EscapesAllTextOfTheRecord) {
  pb::CompareRecord record = made_up_record({});
  const std::string evil = "</script><img src=x onerror=alert(1)>'\"&";
  // Every string of the record, at any depth.
  const std::function<void(google::protobuf::Message&)> poison = [&](google::protobuf::Message& message) {
    const auto* type = message.GetDescriptor();
    const auto* write = message.GetReflection();
    for (int i = 0; i < type->field_count(); ++i) {
      const auto* field = type->field(i);
      const bool text = field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING;
      const bool part = field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE;
      if (field->is_repeated()) {
        if (text && write->FieldSize(message, field) == 0) write->AddString(&message, field, "");
        for (int k = 0; k < write->FieldSize(message, field); ++k) {
          if (text) write->SetRepeatedString(&message, field, k, evil + write->GetRepeatedString(message, field, k));
          if (part) poison(*write->MutableRepeatedMessage(&message, field, k));
        }
      } else if (text && !field->containing_oneof()) {
        write->SetString(&message, field, evil + write->GetString(message, field));
      } else if (part && write->HasField(message, field)) {
        poison(*write->MutableMessage(&message, field));
      }
    }
  };
  poison(record);
  const std::string html = comparison_report(record, nowhere());
  EXPECT_EQ(count_of(html, "<img src=x"), 0);
  EXPECT_EQ(count_of(html, "</script>"), 1);
  EXPECT_GT(count_of(html, "&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;&#39;&quot;&amp;"), 30);
  EXPECT_EQ(count_of(html, "onerror=alert(1)"), count_of(html, "&lt;img src=x onerror=alert(1)"));
}

TEST_F(ReportFolder, LoadsNothing) {
  const RecordShape shape;
  pb::CompareRecord record = made_up_record(shape);
  write_pictures(record, shape, folder_);
  const std::string html = comparison_report(record, folder_);
  const std::regex reference(R"re((?:src|href|action|poster|data|srcset)\s*=\s*["']?([^"'\s>]{0,40}))re");
  std::set<std::string> targets;
  const std::string markup = std::regex_replace(html, std::regex("[A-Za-z0-9+/]{200,}"), "B");
  for (std::sregex_iterator at(markup.begin(), markup.end(), reference), end; at != end; ++at) {
    targets.insert((*at)[1].str().substr(0, 22));
  }
  EXPECT_EQ(targets, std::set<std::string>{"data:image/png;base64,"});
  EXPECT_EQ(count_of(markup, "http://") + count_of(markup, "https://") + count_of(markup, "@import") +
                count_of(markup, " style=\""),
            0);
  for (const char* only : {"default-src 'none'", "script-src 'sha256-", "style-src 'sha256-"})
    EXPECT_NE(html.find(only), std::string::npos) << only;
  EXPECT_EQ(count_of(markup, "<script>"), 1);
}

TEST_F(ReportFolder, ShowsPicturesAndMaps) {
  const RecordShape shape;
  pb::CompareRecord record = made_up_record(shape);
  write_pictures(record, shape, folder_);
  const std::string html = section_of(comparison_report(record, folder_), "pictures");
  EXPECT_EQ(count_of(html, "data-kind=\"radiance\""), 4);
  EXPECT_EQ(count_of(html, "data-kind=\"map\""), 6);
  EXPECT_NE(html.find("signed relative difference of luminance (the variance is not known)"), std::string::npos);
  EXPECT_NE(html.find("<code class=\"copy\">heliograph replay hr1.token-of-bdpt</code>"), std::string::npos);
  EXPECT_NE(html.find("7, 0</span><td>12.5&#8239;%<td>12.5, 0, 0<td>0, 0.250, 0<td>"), std::string::npos);
  EXPECT_EQ(html.find("To keep the page small"), std::string::npos);
}

TEST_F(ReportFolder, SaysWhichPicturesAreMissingOrDamaged) {
  const RecordShape shape;
  pb::CompareRecord record = made_up_record(shape);
  write_pictures(record, shape, folder_);
  fs::remove(folder_ / "pictures/adaptive.view0.exr");
  fs::resize_file(folder_ / "pictures/bdpt.view0.exr", 300);
  std::string html = comparison_report(record, folder_);
  EXPECT_EQ(count_of(html, "data-kind=\"radiance\""), 2);
  EXPECT_NE(html.find("adaptive: there is no picture of this mode."), std::string::npos);
  EXPECT_NE(html.find("bdpt: the picture cannot be shown: "), std::string::npos);
  fs::remove(folder_ / "pictures/reference.view0.exr");
  html = comparison_report(record, folder_);
  EXPECT_NE(html.find("There is no picture of the reference, so there are no maps."), std::string::npos);
  EXPECT_EQ(count_of(html, "data-kind=\"map\""), 0);
  html = comparison_report(record, nowhere());
  EXPECT_NE(html.find("There are no pictures beside the record, so none are shown."), std::string::npos);
  EXPECT_EQ(count_of(html, "id=\"stage\""), 0);
}

TEST_F(ReportFolder, ReadsNoFileOutsideOfTheFolder) {
  const RecordShape shape;
  pb::CompareRecord record = made_up_record(shape);
  write_pictures(record, shape, folder_);
  const fs::path inner = folder_ / "inner";
  fs::create_directories(inner);
  for (auto& picture : *record.mutable_pictures()) picture.set_file("../" + picture.file());
  EXPECT_EQ(count_of(comparison_report(record, inner), "data-kind=\"radiance\""), 0);
  for (auto& picture : *record.mutable_pictures()) picture.set_file((folder_ / picture.file().substr(3)).string());
  EXPECT_EQ(count_of(comparison_report(record, inner), "data-kind=\"radiance\""), 0);
}

TEST_F(ReportFolder, ReducesPicturesThatAreTooLarge) {
  RecordShape shape;
  shape.modes = {"pt"};
  shape.width = 1600;
  shape.height = 800;
  pb::CompareRecord record = made_up_record(shape);
  write_pictures(record, shape, folder_);
  fs::remove(folder_ / "pictures/reference.view0.exr");  // spares the test the maps, which take seconds
  const std::string html = comparison_report(record, folder_);
  EXPECT_NE(html.find("each pixel is the mean of 2 × 2"), std::string::npos);
  EXPECT_NE(html.find("width=\"800\" height=\"400\""), std::string::npos);
  EXPECT_LT(html.size(), 20u << 20);
}

TEST(ComparisonReport, PutsDisturbedAndMissingUnitsInPlainSight) {
  pb::CompareRecord record = made_up_record({});
  record.mutable_units(0)->set_disturbed(true);
  record.mutable_units(40)->set_disturbed(true);
  record.mutable_table()->mutable_points(0)->set_disturbed(1);
  record.mutable_units()->DeleteSubrange(100, 5);
  record.mutable_calls(0)->add_differences("The daemon is another build.");
  const std::string html = comparison_report(record, nowhere());
  EXPECT_NE(html.find("While 2 of 100 units were rendered"), std::string::npos);
  EXPECT_NE(html.find("1 of pt, 1 of adaptive"), std::string::npos);
  EXPECT_NE(html.find("5 of 105 units are missing"), std::string::npos);
  EXPECT_NE(html.find("5 units: seed 5 at 4 samples; seed 5 at 8 samples;"), std::string::npos);
  EXPECT_NE(html.find("<strong>Mixed.</strong> The daemon is another build."), std::string::npos);
  EXPECT_LT(html.find("Disturbed."), html.find("At a glance"));
  const std::string calm = comparison_report(made_up_record({}), nowhere());
  EXPECT_EQ(count_of(calm, "Disturbed.") + count_of(calm, "Incomplete.") + count_of(calm, "Mixed."), 0);
}

TEST(ComparisonReport, SaysInItsHeadThatItIsPartial) {
  pb::CompareRecord record = made_up_record({});
  EXPECT_EQ(comparison_report(record, nowhere()).find("(partial)"), std::string::npos);
  record.mutable_table()->set_partial(true);
  record.mutable_table()->set_sentences(0, "Partial: after 3 of 9 pictures.");
  record.mutable_calls(0)->set_processor("Made-up processor");
  const std::string html = comparison_report(record, nowhere());
  const std::string head = html.substr(0, html.find("</header>"));
  EXPECT_NE(head.find("(partial)</title>"), std::string::npos);
  EXPECT_NE(head.find("(partial)</h1>"), std::string::npos);
  EXPECT_NE(head.find("<p class=\"answer\">Partial: after 3 of 9 pictures.</p>"), std::string::npos);
  EXPECT_NE(section_of(html, "repeat").find("Made-up processor"), std::string::npos);
}

TEST(ComparisonReport, AnyRecordGivesAPage) {
  EXPECT_NE(comparison_report({}, nowhere()).find("has not come to its end"), std::string::npos);
  pb::CompareRecord record = made_up_record({});
  record.clear_table();
  record.clear_calls();
  const std::string html = comparison_report(record, nowhere());
  EXPECT_NE(html.find("The record holds no table of points"), std::string::npos);
  record = made_up_record({});
  record.clear_request();
  EXPECT_NE(comparison_report(record, nowhere()).find("</html>"), std::string::npos);
  record = made_up_record({});
  for (auto& ratio : *record.mutable_table()->mutable_ratios()) {
    ratio.mutable_ratio()->Clear();
    ratio.set_verdict(pb::COMPARE_VERDICT_UNDECIDED);
  }
  EXPECT_NE(comparison_report(record, nowhere()).find("<td class=u>◇ not known"), std::string::npos);
}

// 20 + view + 0.3 seed ms, of views 1 to 3 (from 0), five seeds and seven budgets: the seven largest are 24.5.
TEST(ComparisonReport, TellsThePaceOfPreviews) {
  RecordShape shape;
  shape.views = 4;
  shape.previews = true;
  const std::string html = section_of(comparison_report(made_up_record(shape), nowhere()), "pacing");
  EXPECT_NE(html.find("<td>105<td>22.9<td>22.9<td>24.5<td>24.5<td>24.5<td>14 of 105 above 24 ms<td>"),
            std::string::npos)
      << html;
  EXPECT_EQ(count_of(html, "Histogram of preview times"), 1);
  EXPECT_EQ(section_of(comparison_report(made_up_record({}), nowhere()), "pacing"), "");
}

TEST(ComparisonReport, IsSmallWithoutPictures) {
  RecordShape shape;
  shape.modes = {"pt", "adaptive", "bdpt", "lvc", "vcm", "photon", "reproject", "combined"};
  shape.budgets = 10;
  shape.measures = 12;
  const std::string html = comparison_report(made_up_record(shape), nowhere());
  EXPECT_LT(html.size(), 300'000u);
  if (getenv("HELIO_TMP")) std::ofstream(getenv("HELIO_TMP")) << html;
}

// A page for the browser's test, and for people to look at.
TEST(ComparisonReport, WritesAPageOnRequest) {
  const char* folder = std::getenv("HELIO_REPORT_FOLDER");
  if (!folder) GTEST_SKIP() << "HELIO_REPORT_FOLDER is not set";
  RecordShape shape;
  shape.views = 3;
  shape.previews = true;
  shape.measures = 9;
  shape.width = 320;
  shape.height = 180;
  pb::CompareRecord record = made_up_record(shape);
  record.mutable_units(3)->set_disturbed(true);
  write_pictures(record, shape, folder);
  std::ofstream out(fs::path(folder) / "report.html", std::ios::binary);
  out << comparison_report(record, folder);
  EXPECT_TRUE(out.good());
}

}  // namespace
}  // namespace helio::report
