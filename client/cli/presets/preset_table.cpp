#include "client/cli/presets/preset_table.h"

#include <algorithm>
#include <cmath>

#include "client/cli/comparison_table.h"
#include "client/comparison/comparison_record.h"
#include "client/enum_names.h"

namespace helio::cli {

namespace {

using Interval = pb::CompareInterval;

std::string name_of_mode(const std::string& mode) {
  return mode.substr(0, mode.find('='));
}

// "flip@fovea": the measure, and the region, which may be empty.
std::pair<std::string, std::string> name_and_region(const std::string& measure) {
  const std::size_t at = measure.find('@');
  return {measure.substr(0, at), at == std::string::npos ? "" : measure.substr(at + 1)};
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

// A value of a row, and what speaks against it.
struct Measured {
  Interval value;
  bool few_pixels = false, disturbed = false;
};

std::optional<Measured> seconds_at(const PresetResult& result, const std::string& mode, std::uint32_t samples) {
  if (!result.record) return std::nullopt;
  const pb::ComparePoint* const point = find_point(*result.record, mode, samples, true);
  if (!point || !(point->seconds().mean() > 0)) return std::nullopt;
  return Measured{point->seconds(), false, point->disturbed() > 0};
}

std::optional<Measured> value_at(const PresetResult& result, const std::string& mode, std::uint32_t samples,
                                 const std::string& measure) {
  if (!result.record) return std::nullopt;
  if (is_of_time(measure)) {
    auto seconds = seconds_at(result, mode, samples);
    if (seconds && measure == kFramesMeasure) seconds->value = inverse(seconds->value);
    return seconds;
  }
  const auto [name, region] = name_and_region(measure);
  const auto wanted = from_short_name<pb::CompareMeasure>(name);
  const pb::ComparePoint* const point = find_point(*result.record, mode, samples, false);
  if (!wanted || !point) return std::nullopt;
  for (const auto& value : point->values())
    if (value.measure() == *wanted && value.region() == region)
      return Measured{value.value(), value.few_pixels_decide()};
  return std::nullopt;
}

std::optional<Interval> ratio_of(const pb::CompareRecord& record, const std::string& measure, const SeedsOf& top,
                                 const SeedsOf& bottom) {
  const SeedRatios ratios(record);
  if (measure == kSecondsMeasure) return ratios.of_seconds(top, bottom);
  if (measure == kFramesMeasure) return ratios.of_seconds(bottom, top);
  const auto [name, region] = name_and_region(measure);
  const auto wanted = from_short_name<pb::CompareMeasure>(name);
  const auto last = std::uint32_t(view_count(record.request()) - 1);
  return wanted ? ratios.of_errors(*wanted, last, top, bottom, region) : std::nullopt;
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
  if (row.our_mode.empty() || !result.record) return;
  const std::vector<double> budgets = budgets_of(result.record->request());
  const auto seeds_of = [&](const std::string& mode, std::uint32_t samples) {
    return SeedsOf{mode, std::uint32_t(std::find(budgets.begin(), budgets.end(), samples) - budgets.begin())};
  };
  const SeedsOf top = seeds_of(row.our_mode, row.samples), bottom = seeds_of(first, row.baseline_samples);
  const auto ours = value_at(result, row.our_mode, row.samples, row.measure),
             base = value_at(result, first, row.baseline_samples, row.measure),
             seconds = seconds_at(result, row.our_mode, row.samples),
             base_seconds = seconds_at(result, first, row.baseline_samples);
  const bool itself = row.our_mode == first && row.baseline_samples == row.samples;
  Interval one;
  one.set_mean(1);
  if (ours && base) {
    row.ratio = itself ? one : ratio_of(*result.record, row.measure, top, bottom);
    row.ratio_few_pixels = !itself && (ours->few_pixels || base->few_pixels);
  }
  if (seconds && base_seconds) {
    row.seconds_ratio = itself ? one : ratio_of(*result.record, std::string(kSecondsMeasure), top, bottom);
    row.ratio_disturbed = !itself && (seconds->disturbed || base_seconds->disturbed);
  }
}

void fill(const PresetResult& result, PresetRow& row) {
  if (!row.our_mode.empty()) {
    if (const auto ours = value_at(result, row.our_mode, row.samples, row.measure)) {
      row.ours = ours->value;
      row.few_pixels = ours->few_pixels;
    }
    if (const auto seconds = seconds_at(result, row.our_mode, row.samples)) {
      row.seconds = seconds->value;
      row.disturbed = seconds->disturbed;
    }
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

bool is_of_time(const std::string& measure) {
  return measure == kSecondsMeasure || measure == kFramesMeasure;
}

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

std::pair<std::uint64_t, std::uint64_t> disturbed_units(const PresetResult& result) {
  if (!result.record) return {0, 0};
  const auto& units = result.record->units();
  const auto disturbed = std::count_if(units.begin(), units.end(), [](const auto& unit) { return unit.disturbed(); });
  return {std::uint64_t(disturbed), std::uint64_t(units.size())};
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
