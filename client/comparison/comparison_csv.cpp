#include "client/comparison/comparison_csv.h"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <utility>
#include <vector>

#include "client/comparison/comparison_record.h"
#include "client/enum_names.h"

namespace helio {

namespace {

using Cells = std::vector<std::string>;

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
  std::string text = "\"";
  for (const char c : cell) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + "\"";
}

void add_line(std::string& csv, const Cells& cells) {
  csv += csv_line(cells);
}

// The shortest text that reads back as the same number.
std::string number(double value) {
  return fmt::format("{}", value);
}

std::string yes_no(bool value) {
  return value ? "1" : "0";
}

std::string budget_name(const pb::CompareRecord& record) {
  return record.request().times_s().empty() ? "budget_samples" : "budget_seconds";
}

std::string budget_text(const std::vector<double>& budgets, std::uint32_t index) {
  return index < budgets.size() ? number(budgets[index]) : std::string();
}

void add_interval(Cells& cells, const pb::CompareInterval& interval) {
  cells.push_back(number(interval.mean()));
  cells.push_back(interval.known() ? number(interval.low()) : "");
  cells.push_back(interval.known() ? number(interval.high()) : "");
}

std::string measure_name(pb::CompareMeasure measure) {
  return measure == pb::COMPARE_MEASURE_UNSPECIFIED ? std::string() : to_short_name(measure);
}

}  // namespace

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i ? "," : "") + quoted(cells[i]);
  return line + "\r\n";
}

std::string units_csv(const pb::CompareRecord& record) {
  using Column = std::pair<int, std::string>;  // measure, region
  std::map<Column, std::size_t> columns;
  for (const pb::CompareUnit& unit : record.units()) {
    for (const pb::CompareValue& value : unit.values()) columns.emplace(Column(value.measure(), value.region()), 0);
  }
  Cells header{"mode",  "seed_number",     "seed",        "budget",       "view",     "seconds", "samples", "rays",
               "paths", "invalid_samples", "reuse_share", "others_share", "disturbed"};
  header[3] = budget_name(record);
  const std::size_t fixed = header.size();
  for (auto& [column, index] : columns) {
    index = header.size() - fixed;
    header.push_back(measure_name(static_cast<pb::CompareMeasure>(column.first)) +
                     (column.second.empty() ? "" : " " + column.second));
  }
  std::string csv;
  add_line(csv, header);
  const std::vector<double> budgets = budgets_of(record.request());
  for (const pb::CompareUnit& unit : record.units()) {
    Cells cells{unit.mode(),
                std::to_string(unit.seed_number()),
                std::to_string(unit.seed()),
                budget_text(budgets, unit.budget()),
                std::to_string(unit.view()),
                number(unit.seconds()),
                number(unit.samples()),
                std::to_string(unit.rays()),
                std::to_string(unit.paths()),
                std::to_string(unit.invalid_samples()),
                number(unit.reuse_share()),
                number(unit.others_share()),
                yes_no(unit.disturbed())};
    cells.resize(header.size());
    for (const pb::CompareValue& value : unit.values())
      cells[fixed + columns.at({value.measure(), value.region()})] = number(value.value());
    add_line(csv, cells);
  }
  return csv;
}

std::string points_csv(const pb::CompareRecord& record) {
  std::string csv;
  add_line(csv, {"mode", budget_name(record), "view", "seeds", "seconds", "seconds_low", "seconds_high", "samples",
                 "measure", "region", "mean", "low", "high", "few_pixels_decide", "disturbed"});
  const std::vector<double> budgets = budgets_of(record.request());
  for (const pb::ComparePoint& point : record.table().points()) {
    for (const pb::ComparePoint::Value& value : point.values()) {
      Cells cells{point.mode(), budget_text(budgets, point.budget()),
                  point.all_views() ? "all" : std::to_string(point.view()), std::to_string(point.seeds())};
      add_interval(cells, point.seconds());
      cells.push_back(number(point.samples()));
      cells.push_back(measure_name(value.measure()));
      cells.push_back(value.region());
      add_interval(cells, value.value());
      cells.push_back(yes_no(value.few_pixels_decide()));
      cells.push_back(std::to_string(point.disturbed()));
      add_line(csv, cells);
    }
  }
  return csv;
}

std::string ratios_csv(const pb::CompareRecord& record) {
  std::string csv;
  add_line(csv, {"kind", "mode", "baseline", "measure", "region", "at", "ratio", "low", "high", "verdict",
                 "few_pixels_decide", "different_calls"});
  for (const pb::CompareRatio& ratio : record.table().ratios()) {
    Cells cells{to_short_name(ratio.kind()),   ratio.mode(),   ratio.baseline(),
                measure_name(ratio.measure()), ratio.region(), number(ratio.at())};
    add_interval(cells, ratio.ratio());
    cells.push_back(to_short_name(ratio.verdict()));
    cells.push_back(yes_no(ratio.few_pixels_decide()));
    cells.push_back(yes_no(ratio.different_calls()));
    add_line(csv, cells);
  }
  return csv;
}

}  // namespace helio
