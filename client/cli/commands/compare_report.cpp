#include "client/cli/commands/compare_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/comparison/comparison_record.h"
#include "client/enum_names.h"
#include "renderer/base/number_range.h"

namespace helio::cli {

namespace {

constexpr std::uint32_t kLeastSeeds = 5;  // below, there are no intervals (CompareInterval)

bool is_path(const pb::CompareRecord& record) {
  return record.request().views_size() > 1;
}

std::string budget_text(const pb::CompareRecord& record, std::uint32_t index) {
  const std::vector<double> budgets = budgets_of(record.request());
  if (index >= budgets.size()) return {};
  const bool seconds = !record.request().times_s().empty();
  return number_text(budgets[index]) + (seconds ? " s" : budgets[index] == 1 ? " sample" : " samples");
}

Json to_json(const pb::CompareInterval& interval) {
  Json json;
  json["mean"] = interval.mean();
  json["low"] = interval.known() ? Json(interval.low()) : Json(nullptr);
  json["high"] = interval.known() ? Json(interval.high()) : Json(nullptr);
  return json;
}

Json measure_name(pb::CompareMeasure measure) {
  return measure == pb::COMPARE_MEASURE_UNSPECIFIED ? Json(nullptr) : Json(to_short_name(measure));
}

}  // namespace

CompareClock::CompareClock(const pb::CompareRecord& record)
    : budgets_(budgets_of(record.request())), path_(is_path(record)) {
  const pb::CompareRequest& request = record.request();
  double of_one = 0;
  for (std::uint32_t i = 0; i < budgets_.size(); ++i) of_one += work_of(i);
  work_ = of_one * request.modes_size() * request.seeds() * std::max(1, request.views_size());
  for (const pb::CompareUnit& known : record.units()) work_ -= work_of(known.budget());
}

// A still's picture goes on from the budget before.
double CompareClock::work_of(std::uint32_t budget) const {
  if (budget >= budgets_.size()) return 0;
  return path_ || budget == 0 ? budgets_[budget] : budgets_[budget] - budgets_[budget - 1];
}

void CompareClock::progress(double now_s, bool rendering_modes) {
  if (rendering_ && last_s_ > 0) seconds_ += now_s - last_s_;
  last_s_ = now_s;
  rendering_ = rendering_modes;
}

void CompareClock::unit(const pb::CompareUnit& unit) {
  done_ += work_of(unit.budget());
}

double CompareClock::seconds_left() const {
  if (!(done_ > 0) || !(seconds_ > 0)) return -1;
  return std::max(0.0, work_ - done_) * seconds_ / done_;
}

std::string describe(const pb::CompareResponse::Progress& progress, const pb::CompareRecord& record,
                     double seconds_left) {
  const std::string view = is_path(record) ? fmt::format(" of view {}", progress.view()) : "";
  std::string line;
  if (progress.doing() == "reference" && progress.seed_number() == 0) {
    line = fmt::format("reference{}: {} samples", view, number_text(std::floor(progress.samples())));
    if (progress.error() > 0) {
      line += fmt::format(", error {:.3g}", progress.error());
      const double target = record.request().reference().rendered().error();
      if (target > 0) line += fmt::format(" (to {:.3g})", target);
    }
  } else {
    line = fmt::format("{}: seed {}{}, {:.0f} of {}", progress.doing(), progress.seed_number(), view,
                       std::floor(progress.samples()), budget_text(record, progress.budget()));
  }
  line += fmt::format("; {} of {} units", progress.units_done(), progress.units());
  return seconds_left < 0 ? line : line + ", " + human_seconds(seconds_left) + " left";
}

namespace {

// relmse, else mse, else the first error that can be compared.
pb::CompareMeasure main_measure(const pb::CompareTable& table) {
  std::vector<pb::CompareMeasure> found;
  for (const pb::ComparePoint& point : table.points())
    for (const auto& value : point.values())
      if (value.region().empty()) found.push_back(value.measure());
  for (const auto measure : {pb::COMPARE_MEASURE_RELMSE, pb::COMPARE_MEASURE_MSE})
    if (std::find(found.begin(), found.end(), measure) != found.end()) return measure;
  return found.empty() ? pb::COMPARE_MEASURE_UNSPECIFIED : found.front();
}

std::string interval_text(const pb::CompareInterval& interval, const char* unit = "") {
  if (!interval.known()) return fmt::format("{:.3g}{}", interval.mean(), unit);
  return fmt::format("{:.3g}{} [{:.3g}, {:.3g}]", interval.mean(), unit, interval.low(), interval.high());
}

// At the smallest error for which there is one.
const pb::CompareRatio* equal_error(const pb::CompareTable& table, const std::string& mode,
                                    pb::CompareMeasure measure) {
  const pb::CompareRatio* found = nullptr;
  for (const pb::CompareRatio& ratio : table.ratios()) {
    if (ratio.kind() != pb::CompareRatio::KIND_EQUAL_ERROR || ratio.mode() != mode || ratio.measure() != measure ||
        !ratio.region().empty())
      continue;
    if (!found || ratio.at() < found->at()) found = &ratio;
  }
  return found;
}

const pb::ComparePoint* last_point(const pb::CompareRecord& record, const std::string& mode) {
  const pb::ComparePoint* found = nullptr;
  for (const pb::ComparePoint& point : record.table().points()) {
    if (point.mode() != mode || point.all_views() != is_path(record)) continue;
    if (!found || point.budget() >= found->budget()) found = &point;
  }
  return found;
}

}  // namespace

std::vector<std::string> describe_table(const pb::CompareRecord& record) {
  const pb::CompareTable& table = record.table();
  const pb::CompareMeasure measure = main_measure(table);
  using Cells = std::array<std::string, 5>;
  std::vector<Cells> rows;
  const bool intervals = record.request().seeds() >= kLeastSeeds;
  const std::string error = measure == pb::COMPARE_MEASURE_UNSPECIFIED ? "error" : to_short_name(measure);
  rows.push_back({"mode", "budget", error + (intervals ? " [95 %]" : ""), intervals ? "seconds [95 %]" : "seconds",
                  "speed-up at equal error"});
  for (const pb::CompareMode& mode : record.request().modes()) {
    const pb::ComparePoint* const point = last_point(record, mode.name());
    if (!point) continue;
    std::string value = "-";
    for (const auto& known : point->values())
      if (known.measure() == measure && known.region().empty()) value = interval_text(known.value());
    std::string speed = "-";
    if (mode.name() == record.request().modes(0).name()) {
      speed = "1x (the others are compared with it)";
    } else if (const pb::CompareRatio* const ratio = equal_error(table, mode.name(), measure)) {
      speed = fmt::format("{} at {:.3g}: {}", interval_text(ratio->ratio(), "x"), ratio->at(),
                          ratio->verdict() == pb::COMPARE_VERDICT_BETTER  ? "faster"
                          : ratio->verdict() == pb::COMPARE_VERDICT_WORSE ? "slower"
                                                                          : "undecided");
    }
    rows.push_back({mode.name(), budget_text(record, point->budget()), value, interval_text(point->seconds()), speed});
  }
  std::array<std::size_t, 4> widths{};
  for (const Cells& row : rows)
    for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::vector<std::string> lines;
  for (const Cells& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < widths.size(); ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    lines.push_back(line + row.back());
  }
  lines.insert(lines.end(), table.sentences().begin(), table.sentences().end());
  return lines;
}

namespace {

Json points_json(const pb::CompareRecord& record) {
  const std::vector<double> budgets = budgets_of(record.request());
  Json points = Json::array();
  for (const pb::ComparePoint& point : record.table().points()) {
    Json json;
    json["mode"] = point.mode();
    json["budget"] = point.budget() < budgets.size() ? Json(budgets[point.budget()]) : Json(nullptr);
    json["view"] = point.all_views() ? Json(nullptr) : Json(point.view());
    json["seeds"] = point.seeds();
    json["seconds"] = to_json(point.seconds());
    json["samples"] = point.samples();
    json["disturbed"] = point.disturbed();
    json["values"] = Json::array();
    for (const auto& value : point.values()) {
      Json entry;
      entry["measure"] = measure_name(value.measure());
      entry["region"] = value.region();
      entry.update(to_json(value.value()));
      entry["few_pixels_decide"] = value.few_pixels_decide();
      json["values"].push_back(entry);
    }
    points.push_back(json);
  }
  return points;
}

Json ratios_json(const pb::CompareTable& table) {
  Json ratios = Json::array();
  for (const pb::CompareRatio& ratio : table.ratios()) {
    Json json;
    json["kind"] = to_short_name(ratio.kind());
    json["mode"] = ratio.mode();
    json["baseline"] = ratio.baseline();
    json["measure"] = measure_name(ratio.measure());
    json["region"] = ratio.region();
    json["at"] = ratio.at();
    json.update(to_json(ratio.ratio()));
    json["verdict"] = to_short_name(ratio.verdict());
    ratios.push_back(json);
  }
  return ratios;
}

}  // namespace

void add_comparison(Json& json, const pb::CompareRecord& record) {
  const pb::CompareRequest& request = record.request();
  json["modes"] = Json::array();
  for (const pb::CompareMode& mode : request.modes()) json["modes"].push_back(mode.name());
  json["budgets"] = budgets_of(request);
  json["budgets_in"] = request.times_s().empty() ? "samples" : "seconds";
  json["seeds"] = request.seeds();
  json["views"] = std::max(1, request.views_size());
  json["units"] = record.units_size();
  json["units_total"] = unit_count(request);
  json["units_rendered"] = record.calls().empty() ? 0 : record.calls(record.calls_size() - 1).units();
  json["references"] = Json::array();
  for (const auto& reference : record.references()) {
    Json entry;
    entry["view"] = reference.view();
    entry["noise"] = reference.noise() == 0 ? Json(nullptr) : Json(to_short_name(reference.noise()));
    entry["error"] = reference.error() > 0 ? Json(reference.error()) : Json(nullptr);
    entry["samples"] = reference.samples() > 0 ? Json(reference.samples()) : Json(nullptr);
    entry["seconds"] = reference.seconds();
    json["references"].push_back(entry);
  }
  json["differences"] = Json::array();
  for (const auto& call : record.calls())
    for (const std::string& difference : call.differences()) json["differences"].push_back(difference);
  json["points"] = points_json(record);
  json["ratios"] = ratios_json(record.table());
  json["sentences"] = Json::array();
  for (const std::string& sentence : record.table().sentences()) json["sentences"].push_back(sentence);
}

const char* const kCompareJsonHelp =
    "With --json, stdout holds one object: load_seconds, seconds, rendering_seconds (modes and references), output "
    "(the\n"
    "folder), report, scene_id, width, height, modes (names), budgets, budgets_in (samples or seconds), seeds, views,\n"
    "units (pictures in the folder), units_total, units_rendered (by this call), references: [{view, noise (halves,\n"
    "variance, null: not known), error, samples, seconds}], differences (that --mix let pass), points: [{mode, "
    "budget,\n"
    "view (null: the mean over a path), seeds, seconds: {mean, low, high}, samples, disturbed, values: [{measure, "
    "region\n"
    "(empty: the whole picture), mean, low, high, few_pixels_decide}]}], ratios: [{kind (equal-error, equal-time,\n"
    "equal-samples, speed), mode, baseline, measure, region, at, mean, low, high, verdict (better, worse,\n"
    "undecided)}], sentences, partial, warnings, notices, unread; on failure also error and exit_code. low and high "
    "are\n"
    "the 95 % interval over seeds, null where there is none.\n";

}  // namespace helio::cli
