#include "server/metrics/exposition.h"

#include <prometheus/text_serializer.h>

#include <limits>

namespace helio {

namespace {

prometheus::ClientMetric labelled(const Exposition::Labels& labels) {
  prometheus::ClientMetric metric;
  for (const auto& [name, value] : labels) metric.label.push_back({name, value});
  return metric;
}

}  // namespace

Exposition::Family Exposition::begin(std::string name, std::string help, prometheus::MetricType type) {
  prometheus::MetricFamily& family = families_.emplace_back();
  family.name = std::move(name);
  family.help = std::move(help);
  family.type = type;
  return Family(family);
}

Exposition::Family& Exposition::Family::add(double value, const Labels& labels) {
  prometheus::ClientMetric metric = labelled(labels);
  if (family_.type == kCounter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  family_.metric.push_back(std::move(metric));
  return *this;
}

// The count is that of the buckets as they were read, so that it equals the last one whatever is counted meanwhile.
Exposition::Family& Exposition::Family::add(const Histogram& histogram, const Labels& labels) {
  prometheus::ClientMetric metric = labelled(labels);
  auto& told = metric.histogram;
  for (std::size_t i = 0; i <= histogram.bounds(); ++i) {
    told.sample_count += histogram.count(i);
    const double upper =
        i < histogram.bounds() ? histogram.upper(i) : std::numeric_limits<double>::infinity();
    told.bucket.push_back({told.sample_count, upper});
  }
  told.sample_sum = histogram.sum();
  family_.metric.push_back(std::move(metric));
  return *this;
}

std::string Exposition::text() const {
  return prometheus::TextSerializer().Serialize(families_);
}

}  // namespace helio
