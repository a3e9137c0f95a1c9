#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "client/report/html_text.h"
#include "client/report/number_text.h"
#include "client/report/pacing_section.h"

namespace helio::report {
namespace {

TEST(HtmlText, EscapesWhatMarkupIsMadeOf) {
  EXPECT_EQ(escaped("<b a=\"x\" c='y'>&amp;"), "&lt;b a=&quot;x&quot; c=&#39;y&#39;&gt;&amp;amp;");
  EXPECT_EQ(escaped(std::string("a\0b\x1b"
                                "c\x7f",
                                6)),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD"
            "c\xEF\xBF\xBD");
  EXPECT_EQ(escaped("Zürich\n\tmit Höhe"), "Zürich\n\tmit Höhe");
}

// The test vectors of RFC 4648, section 10.
TEST(HtmlText, Base64) {
  const auto of = [](std::string_view text) {
    return base64(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foo"), "Zm9v");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
  EXPECT_EQ(of("\xff\xfe\xfd"), "//79");
}

TEST(NumberText, PrintsThreeSignificantDigits) {
  const std::vector<std::pair<double, const char*>> cases{{0, "0"},
                                                          {1, "1.00"},
                                                          {1.5, "1.50"},
                                                          {0.123456, "0.123"},
                                                          {-0.0123456, "-0.0123"},
                                                          {0.00123, "0.00123"},
                                                          {0.000123, "1.23e-4"},
                                                          {9.996, "10.0"},
                                                          {0.9996, "1.00"},
                                                          {999.6, "1000"},
                                                          {12345.6, "12300"},
                                                          {65536, "65500"},
                                                          {2.5e6, "2.50e6"},
                                                          {1e-300, "1.00e-300"},
                                                          {0.0009999, "1.00e-3"}};
  for (const auto& [value, text] : cases) EXPECT_EQ(number(value), text) << value;
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "unknown");
  EXPECT_EQ(number(std::nan("")), "unknown");
}

TEST(NumberText, PrintsSettingsAsTheyWereWritten) {
  EXPECT_EQ(plain_number(64), "64");
  EXPECT_EQ(plain_number(65536), "65536");
  EXPECT_EQ(plain_number(0.5), "0.5");
}

TEST(NumberText, IntervalsThatAreNotKnownHaveNoNumbers) {
  heliograph::v1::CompareInterval interval;
  interval.set_mean(2);
  EXPECT_EQ(interval_text(interval), "");
  interval.set_known(true);
  interval.set_low(1.25);
  interval.set_high(3);
  EXPECT_EQ(interval_text(interval), "[1.25, 3.00]");
}

TEST(Percentile, IsTheSmallestValueThatTheShareDoesNotExceed) {
  std::vector<double> values;
  for (int i = 1; i <= 20; ++i) values.push_back(i);
  EXPECT_EQ(percentile(values, 0.5), 10);
  EXPECT_EQ(percentile(values, 0.95), 19);
  EXPECT_EQ(percentile(values, 1), 20);
  EXPECT_EQ(percentile({7}, 0.5), 7);
}

}  // namespace
}  // namespace helio::report
