#include "client/cli/comparison_table.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "client/comparison/comparison_record.h"
#include "renderer/comparison/comparison_table.h"
#include "renderer/comparison/interval.h"
#include "renderer/comparison/log_ratio.h"
#include "server/compare/compare_table.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

// One number of each seed, by its number.
using BySeed = std::map<std::uint32_t, double>;
// The logarithm of a mean over these seeds; NaN where there is none.
using LogMean = double (*)(const std::vector<double>& values);

double log_of_mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum > 0 ? std::log(sum / double(values.size())) : std::numeric_limits<double>::quiet_NaN();
}

double mean_of_logs(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value > 0 ? std::log(value) : std::numeric_limits<double>::quiet_NaN();
  return values.empty() ? std::numeric_limits<double>::quiet_NaN() : sum / double(values.size());
}

LogJackknife leave_one_out(const BySeed& values, LogMean log_mean) {
  std::vector<std::uint32_t> seeds;
  if (values.size() >= std::size_t(kLeastSeeds))
    for (const auto& [seed, unused] : values) seeds.push_back(seed);
  return jackknife(seeds, [&](std::optional<std::uint32_t> left_out) {
    std::vector<double> kept;
    for (const auto& [seed, value] : values)
      if (seed != left_out) kept.push_back(value);
    return log_mean(kept);
  });
}

void keep_common(BySeed& a, BySeed& b) {
  std::erase_if(a, [&](const auto& entry) { return !b.contains(entry.first); });
  std::erase_if(b, [&](const auto& entry) { return !a.contains(entry.first); });
}

std::optional<pb::CompareInterval> ratio_of(BySeed top, BySeed bottom, bool paired, LogMean log_mean) {
  if (paired) keep_common(top, bottom);
  if (top.empty() || bottom.empty()) return std::nullopt;
  const auto ratio = log_ratio(leave_one_out(top, log_mean), leave_one_out(bottom, log_mean), paired);
  if (!ratio) return std::nullopt;
  pb::CompareInterval message;
  message.set_mean(ratio->mean);
  message.set_known(ratio->known);
  if (!ratio->known) return message;
  message.set_low(ratio->low);
  message.set_high(ratio->high);
  return message;
}

bool is_of(const pb::CompareUnit& unit, const SeedsOf& seeds) {
  return unit.mode() == seeds.mode && unit.budget() == seeds.budget;
}

BySeed errors_of(const pb::CompareRecord& record, const SeedsOf& seeds, pb::CompareMeasure measure,
                 std::uint32_t view, const std::string& region) {
  BySeed values;
  for (const pb::CompareUnit& unit : record.units()) {
    if (!is_of(unit, seeds) || unit.view() != view) continue;
    for (const pb::CompareValue& value : unit.values())
      if (value.measure() == measure && value.region() == region) values.emplace(unit.seed_number(), value.value());
  }
  return values;
}

// Seeds that lack a view are left out.
BySeed seconds_of(const pb::CompareRecord& record, const SeedsOf& seeds) {
  std::map<std::uint32_t, std::vector<double>> found;
  for (const pb::CompareUnit& unit : record.units())
    if (is_of(unit, seeds)) found[unit.seed_number()].push_back(unit.seconds());
  BySeed values;
  for (const auto& [seed, seconds] : found) {
    if (int(seconds.size()) != view_count(record.request())) continue;
    double sum = 0;
    for (const double one : seconds) sum += one;
    values.emplace(seed, sum / double(seconds.size()));
  }
  return values;
}

bool are_paired(const pb::CompareRecord& record, const SeedsOf& top, const SeedsOf& bottom) {
  return record.request().common_seeds() || top.mode == bottom.mode;
}

}  // namespace

std::optional<pb::CompareTable> partial_table(const pb::CompareRecord& record) {
  if (record.units().empty()) return std::nullopt;
  const pb::CompareRequest& request = record.request();
  ComparisonScript script;
  for (const pb::CompareMode& mode : request.modes()) {
    script.modes.push_back(mode.name());
    if (mode.picture() == pb::COMPARED_PICTURE_PREVIEW) script.preview_modes.push_back(mode.name());
  }
  script.budgets = budgets_of(request);
  script.budgets_are_seconds = !request.times_s().empty();
  script.views = std::uint32_t(view_count(request));
  script.common_seeds = request.common_seeds();
  std::vector<ComparedUnit> units;
  for (const pb::CompareUnit& unit : record.units()) units.push_back(unit_of(unit));
  ComparisonTable computed = compare_units(script, units);
  computed.sentences.insert(computed.sentences.begin(),
                            fmt::format("Partial: the comparison was interrupted or failed after {} of {} pictures, "
                                        "and the rest of this is about these alone.",
                                        record.units_size(), unit_count(request)));
  pb::CompareTable table = to_message(computed);
  table.set_partial(true);
  return table;
}

SeedRatios::SeedRatios(const pb::CompareRecord& record) : record_(record) {}

std::optional<pb::CompareInterval> SeedRatios::of_errors(pb::CompareMeasure measure, std::uint32_t view,
                                                         const SeedsOf& top, const SeedsOf& bottom,
                                                         const std::string& region) const {
  return ratio_of(errors_of(record_, top, measure, view, region), errors_of(record_, bottom, measure, view, region),
                  are_paired(record_, top, bottom), log_of_mean);
}

std::optional<pb::CompareInterval> SeedRatios::of_seconds(const SeedsOf& top, const SeedsOf& bottom) const {
  return ratio_of(seconds_of(record_, top), seconds_of(record_, bottom), are_paired(record_, top, bottom),
                  mean_of_logs);
}

}  // namespace helio::cli
