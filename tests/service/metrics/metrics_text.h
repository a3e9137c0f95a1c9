// Reads the text format of Prometheus (version 0.0.4) and finds fault with all that its description does not allow.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace helio::test {

struct MetricSample {
  std::string name;  // of a histogram with _bucket, _sum or _count
  std::map<std::string, std::string> labels;
  double value = 0;
};

struct MetricFamily {
  std::string help, type;
  std::vector<MetricSample> samples;

  std::set<std::string> label_names() const;  // without a histogram's `le`
};

class MetricsText {
 public:
  // Expects that the text is well-formed: each fault is a failure of the test.
  explicit MetricsText(const std::string& text);

  const std::map<std::string, MetricFamily>& families() const { return families_; }
  // Of the one sample of this name with all of these labels, beside others or not. Nothing: there is none, or several.
  std::optional<double> find(const std::string& name, const std::map<std::string, std::string>& labels = {}) const;
  // The same; 0 where there is none.
  double value(const std::string& name, const std::map<std::string, std::string>& labels = {}) const {
    return find(name, labels).value_or(0);
  }

 private:
  void read_comment(const std::string& line);
  void read_sample(const std::string& line);
  void check_histogram(const std::string& name, const MetricFamily& family) const;

  std::map<std::string, MetricFamily> families_;
  std::string current_;  // the family whose lines are read
  std::set<std::string> series_;
};

}  // namespace helio::test
