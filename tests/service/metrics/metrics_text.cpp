#include "metrics/metrics_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <regex>
#include <sstream>

namespace helio::test {
namespace {

const std::regex kMetricName("[a-zA-Z_:][a-zA-Z0-9_:]*"), kLabelName("[a-zA-Z_][a-zA-Z0-9_]*");

// The family that a sample's name is of.
std::string family_of(const std::string& name, const std::string& type, const std::string& family) {
  if (type != "histogram") return name;
  for (const char* ending : {"_bucket", "_sum", "_count"}) {
    if (name == family + ending) return family;
  }
  return name;
}

// Numbers as Go's ParseFloat reads them.
std::optional<double> read_value(const std::string& text) {
  if (text == "+Inf" || text == "-Inf") return text[0] == '+' ? INFINITY : -INFINITY;
  if (text == "NaN" || text == "Nan") return NAN;
  static const std::regex kNumber("[+-]?[0-9]+(\\.[0-9]+)?([eE][+-]?[0-9]+)?");
  if (!std::regex_match(text, kNumber)) return std::nullopt;
  return std::strtod(text.c_str(), nullptr);
}

}  // namespace

std::set<std::string> MetricFamily::label_names() const {
  std::set<std::string> names;
  for (const MetricSample& sample : samples) {
    for (const auto& [name, value] : sample.labels) {
      if (type != "histogram" || name != "le") names.insert(name);
    }
  }
  return names;
}

MetricsText::MetricsText(const std::string& text) {
  EXPECT_TRUE(text.ends_with('\n')) << "the last line has no end";
  EXPECT_EQ(text.find('\r'), std::string::npos);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      ADD_FAILURE() << "an empty line";
    } else if (line[0] == '#') {
      read_comment(line);
    } else {
      read_sample(line);
    }
  }
  for (const auto& [name, family] : families_) {
    EXPECT_NE(family.help, "") << name << " has no HELP";
    EXPECT_NE(family.type, "") << name << " has no TYPE";
    EXPECT_EQ(name.ends_with("_total"), family.type == "counter") << name;
    if (family.type == "histogram") check_histogram(name, family);
  }
}

// "# HELP name text" and then "# TYPE name type", before the family's samples.
void MetricsText::read_comment(const std::string& line) {
  static const std::regex kComment("# (HELP|TYPE) ([a-zA-Z0-9_:]+) (.+)");
  std::smatch parts;
  if (!std::regex_match(line, parts, kComment)) {
    ADD_FAILURE() << line;
    return;
  }
  const std::string name = parts[2];
  EXPECT_TRUE(std::regex_match(name, kMetricName)) << line;
  if (parts[1] == "HELP") {
    EXPECT_FALSE(families_.contains(name)) << "a second time: " << line;
    families_[name].help = parts[3];
    current_ = name;
    return;
  }
  EXPECT_EQ(name, current_) << "TYPE does not follow HELP: " << line;
  EXPECT_EQ(families_[name].type, "") << "a second time: " << line;
  static const std::set<std::string> kTypes = {"counter", "gauge", "histogram"};
  EXPECT_TRUE(kTypes.contains(parts[3])) << line;
  families_[name].type = parts[3];
}

void MetricsText::read_sample(const std::string& line) {
  MetricSample sample;
  std::size_t at = line.find_first_of("{ ");
  if (at == std::string::npos) {
    ADD_FAILURE() << line;
    return;
  }
  sample.name = line.substr(0, at);
  EXPECT_TRUE(std::regex_match(sample.name, kMetricName)) << line;
  if (line[at] == '{') {
    for (++at; at < line.size() && line[at] != '}';) {
      const std::size_t equals = line.find('=', at);
      if (equals == std::string::npos || equals + 1 >= line.size() || line[equals + 1] != '"') {
        ADD_FAILURE() << line;
        return;
      }
      const std::string label = line.substr(at, equals - at);
      EXPECT_TRUE(std::regex_match(label, kLabelName)) << line;
      std::string value;
      for (at = equals + 2; at < line.size() && line[at] != '"'; ++at) {
        if (line[at] != '\\') {
          value += line[at];
          continue;
        }
        const char escaped = ++at < line.size() ? line[at] : '\0';
        EXPECT_TRUE(escaped == '\\' || escaped == '"' || escaped == 'n') << line;
        value += escaped == 'n' ? '\n' : escaped;
      }
      EXPECT_TRUE(sample.labels.emplace(label, value).second) << "twice: " << line;
      if (++at < line.size() && line[at] == ',') ++at;
    }
    ++at;
  }
  if (at >= line.size() || line[at] != ' ') {
    ADD_FAILURE() << line;
    return;
  }
  const auto value = read_value(line.substr(at + 1));  // a time after it would be none of ours
  EXPECT_TRUE(value) << line;
  sample.value = value.value_or(0);
  EXPECT_TRUE(series_.insert(line.substr(0, at)).second) << "the same series twice: " << line;
  auto& family = families_[current_];
  EXPECT_EQ(family_of(sample.name, family.type, current_), current_) << "outside of its family: " << line;
  EXPECT_TRUE(family.type != "counter" || sample.value >= 0) << line;
  family.samples.push_back(std::move(sample));
}

// For each set of labels: buckets that ascend and never fall, up to +Inf, which has the count; a sum.
void MetricsText::check_histogram(const std::string& name, const MetricFamily& family) const {
  struct Series {
    std::vector<std::pair<double, double>> buckets;
    std::optional<double> sum, count;
  };
  std::map<std::map<std::string, std::string>, Series> all;
  for (const MetricSample& sample : family.samples) {
    auto labels = sample.labels;
    const std::string bound = labels.contains("le") ? labels["le"] : "";
    labels.erase("le");
    Series& series = all[labels];
    if (sample.name == name + "_sum") series.sum = sample.value;
    if (sample.name == name + "_count") series.count = sample.value;
    if (sample.name != name + "_bucket") continue;
    const auto upper = read_value(bound);
    EXPECT_TRUE(upper) << name << " le=" << bound;
    series.buckets.emplace_back(upper.value_or(0), sample.value);
  }
  for (const auto& [labels, series] : all) {
    ASSERT_FALSE(series.buckets.empty()) << name;
    EXPECT_TRUE(std::is_sorted(series.buckets.begin(), series.buckets.end())) << name;
    for (std::size_t i = 1; i < series.buckets.size(); ++i)
      EXPECT_LE(series.buckets[i - 1].second, series.buckets[i].second) << name;
    EXPECT_TRUE(std::isinf(series.buckets.back().first)) << name;
    EXPECT_EQ(series.count, series.buckets.back().second) << name;
    EXPECT_TRUE(series.sum) << name;
  }
}

std::optional<double> MetricsText::find(const std::string& name,
                                        const std::map<std::string, std::string>& labels) const {
  std::optional<double> found;
  for (const auto& [family, content] : families_) {
    for (const MetricSample& sample : content.samples) {
      const bool same = sample.name == name && std::all_of(labels.begin(), labels.end(), [&](const auto& label) {
                          const auto there = sample.labels.find(label.first);
                          return there != sample.labels.end() && there->second == label.second;
                        });
      if (!same) continue;
      if (found) return std::nullopt;
      found = sample.value;
    }
  }
  return found;
}

}  // namespace helio::test
