#include "client/cli/presets/preset_table.h"

#include <algorithm>
#include <cmath>

#include "client/comparison_record.h"
#include "client/enum_names.h"

namespace helio::cli {

namespace {

using Interval = pb::CompareInterval;

std::string name_of_mode(const std::string& mode) {
  return mode.substr(0, mode.find('='));
}

std::string baseline_of(const Experiment& experiment) {
  return name_of_mode(experiment.modes.front());
}

const pb::ComparePoint* find_point(const pb::CompareRecord& record, const std::string& mode, std::uint32_t samples,
                                   bool whole_path) {
  const std::vector<double> budgets = budgets_of(record.request());
  const int views = std::max(1, record.request().views_size());
  for (const pb::ComparePoint& point : record.table().points()) {
    if (point.mode() != mode || point.budget() >= budgets.size() || budgets[point.budget()] != samples) continue;
    if (views == 1 || (whole_path ? point.all_views() : !point.all_views() && int(point.view()) == views - 1))
      return &point;
  }
  return nullptr;
}

Interval inverse(const Interval& interval) {
  Interval result;
  result.set_mean(1 / interval.mean());
  result.set_known(interval.known() && interval.low() > 0);
  if (!result.known()) return result;
  result.set_low(1 / interval.high());
  result.set_high(1 / interval.low());
  return result;
}

// The ratio of independent means.
Interval ratio_of(const Interval& a, const Interval& b) {
  Interval result;
  result.set_mean(a.mean() / b.mean());
  const auto has_log = [](const Interval& i) { return i.known() && i.low() > 0 && i.mean() > 0; };
  if (!has_log(a) || !has_log(b)) return result;
  const double down = std::hypot(std::log(a.mean() / a.low()), std::log(b.high() / b.mean()));
  const double up = std::hypot(std::log(a.high() / a.mean()), std::log(b.mean() / b.low()));
  result.set_known(true);
  result.set_low(result.mean() * std::exp(-down));
  result.set_high(result.mean() * std::exp(up));
  return result;
}

std::optional<Interval> seconds_at(const PresetResult& result, const std::string& mode, std::uint32_t samples) {
  if (!result.record) return std::nullopt;
  const pb::ComparePoint* const point = find_point(*result.record, mode, samples, true);
  return point && point->seconds().mean() > 0 ? std::optional(point->seconds()) : std::nullopt;
}

std::optional<Interval> value_at(const PresetResult& result, const std::string& mode, std::uint32_t samples,
                                 const std::string& measure) {
  if (!result.record) return std::nullopt;
  if (measure == kSecondsMeasure) return seconds_at(result, mode, samples);
  if (measure == kFramesMeasure) {
    const auto seconds = seconds_at(result, mode, samples);
    return seconds ? std::optional(inverse(*seconds)) : std::nullopt;
  }
  const auto wanted = from_short_name<pb::CompareMeasure>(measure);
  const pb::ComparePoint* const point = find_point(*result.record, mode, samples, false);
  if (!wanted || !point) return std::nullopt;
  for (const auto& value : point->values())
    if (value.measure() == *wanted && value.region().empty()) return value.value();
  return std::nullopt;
}

// The first mode's figure that another is compared with: of the same time, else of the same samples.
const PublishedFigure* published_baseline(const Experiment& experiment, const PublishedFigure& figure) {
  const std::string& first = experiment.published.front().mode;
  const PublishedFigure* same_samples = nullptr;
  for (const PublishedFigure& other : experiment.published) {
    if (other.mode != first || other.measure != figure.measure || other.view != figure.view) continue;
    if (other.seconds == figure.seconds) return &other;  // never where a time is not published
    if (other.samples == figure.samples && !same_samples) same_samples = &other;
  }
  return same_samples;
}

void compare_with_first(const PresetResult& result, PresetRow& row) {
  const std::string first = baseline_of(result.experiment);
  row.baseline_samples = row.samples;
  if (row.published) {
    const PublishedFigure* const base = published_baseline(result.experiment, *row.published);
    if (base) {
      row.baseline_samples = base->samples;
      row.published_ratio = row.published->value / base->value;
      row.published_seconds_ratio = row.published->seconds / base->seconds;
    }
  }
  if (row.our_mode.empty()) return;
  const auto base = value_at(result, first, row.baseline_samples, row.measure);
  const auto base_seconds = seconds_at(result, first, row.baseline_samples);
  const bool itself = row.our_mode == first && row.baseline_samples == row.samples;
  if (row.ours && base && base->mean() != 0) {
    row.ratio = itself ? Interval() : ratio_of(*row.ours, *base);
    if (itself) row.ratio->set_mean(1);
  }
  if (row.seconds && base_seconds) {
    row.seconds_ratio = itself ? Interval() : ratio_of(*row.seconds, *base_seconds);
    if (itself) row.seconds_ratio->set_mean(1);
  }
}

void fill(const PresetResult& result, PresetRow& row) {
  if (!row.our_mode.empty()) {
    row.ours = value_at(result, row.our_mode, row.samples, row.measure);
    row.seconds = seconds_at(result, row.our_mode, row.samples);
  }
  compare_with_first(result, row);
  if (row.our_mode.empty()) {
    row.remark = "missing mode: Heliograph has no such mode";
  } else if (!row.ours) {
    row.remark = !result.problem.empty() ? result.problem : "no such budget in this comparison (--samples)";
  }
}

std::vector<std::uint32_t> budgets_in(const PresetResult& result) {
  if (!result.record) return result.experiment.samples;
  const auto& samples = result.record->request().samples();
  return {samples.begin(), samples.end()};
}

}  // namespace

void fill_rows(PresetResult& result) {
  const Experiment& experiment = result.experiment;
  result.rows.clear();
  for (const PublishedFigure& figure : experiment.published) {
    PresetRow row{figure.mode, figure.our_mode, figure.samples, figure.measure, figure.view, figure};
    fill(result, row);
    result.rows.push_back(std::move(row));
  }
  if (!result.record) {
    if (result.rows.empty()) {
      PresetRow row;
      row.mode = "all modes";
      row.remark = result.problem;
      result.rows.push_back(std::move(row));
    }
    return;
  }
  for (const std::string& measure : experiment.measures) {
    for (const std::string& mode : experiment.modes) {
      const std::string name = name_of_mode(mode);
      const bool printed = std::any_of(
          experiment.published.begin(), experiment.published.end(),
          [&](const PublishedFigure& figure) { return figure.our_mode == name && figure.measure == measure; });
      if (printed) continue;
      for (const std::uint32_t samples : budgets_in(result)) {
        PresetRow row{name, name, samples, measure, "", std::nullopt};
        fill(result, row);
        result.rows.push_back(std::move(row));
      }
    }
  }
}

std::vector<std::string> preset_names() {
  return {"schalk", "soares", "mrad"};
}

std::optional<Preset> find_preset(const std::string& name) {
  for (const auto make : {schalk_preset, soares_preset, mrad_preset}) {
    Preset preset = make();
    if (preset.name == name) return preset;
  }
  return std::nullopt;
}

}  // namespace helio::cli
