// Metrics as text that Prometheus reads.
#pragma once

#include <prometheus/metric_family.h>

#include <string>
#include <utility>
#include <vector>

#include "server/metrics/counters.h"

namespace helio {

class Exposition {
 public:
  using Labels = std::vector<std::pair<std::string, std::string>>;
  // One metric with all its labels. Valid until the next one is begun.
  class Family {
   public:
    Family& add(double value, const Labels& labels = {});
    Family& add(const Histogram& histogram, const Labels& labels = {});  // of a histogram

   private:
    friend class Exposition;
    explicit Family(prometheus::MetricFamily& family) : family_(family) {}
    prometheus::MetricFamily& family_;
  };

  // A name once at most, of letters, digits and '_'; a counter's ends with _total. help: one sentence.
  Family counter(std::string name, std::string help) { return begin(std::move(name), std::move(help), kCounter); }
  Family gauge(std::string name, std::string help) { return begin(std::move(name), std::move(help), kGauge); }
  Family histogram(std::string name, std::string help) {
    return begin(std::move(name), std::move(help), prometheus::MetricType::Histogram);
  }

  std::string text() const;  // version 0.0.4

 private:
  static constexpr auto kCounter = prometheus::MetricType::Counter, kGauge = prometheus::MetricType::Gauge;
  Family begin(std::string name, std::string help, prometheus::MetricType type);

  std::vector<prometheus::MetricFamily> families_;
};

}  // namespace helio
