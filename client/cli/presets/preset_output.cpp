#include "client/cli/presets/preset_output.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/comparison_csv.h"
#include "client/report/number_text.h"

namespace helio::cli {

namespace {

using MaybeInterval = std::optional<pb::CompareInterval>;

// In full precision; empty: not known.
std::string exact(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

void add_interval(std::vector<std::string>& cells, const MaybeInterval& interval) {
  cells.push_back(interval ? exact(interval->mean()) : "");
  cells.push_back(interval && interval->known() ? exact(interval->low()) : "");
  cells.push_back(interval && interval->known() ? exact(interval->high()) : "");
}

Json number_json(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json to_json(const MaybeInterval& interval) {
  if (!interval) return nullptr;
  Json json;
  json["mean"] = number_json(interval->mean());
  json["low"] = interval->known() ? Json(interval->low()) : Json(nullptr);
  json["high"] = interval->known() ? Json(interval->high()) : Json(nullptr);
  return json;
}

Json to_json(const PresetRow& row) {
  Json json;
  json["mode"] = row.mode;
  json["our_mode"] = row.our_mode.empty() ? Json(nullptr) : Json(row.our_mode);
  json["view"] = row.view;
  json["samples"] = row.samples;
  json["baseline_samples"] = row.baseline_samples;
  json["measure"] = row.measure;
  json["published"] = row.published ? number_json(row.published->value) : Json(nullptr);
  json["published_seconds"] = row.published ? number_json(row.published->seconds) : Json(nullptr);
  json["place"] = row.published ? Json(row.published->place) : Json(nullptr);
  json["published_ratio"] = number_json(row.published_ratio);
  json["published_seconds_ratio"] = number_json(row.published_seconds_ratio);
  json["ours"] = to_json(row.ours);
  json["seconds"] = to_json(row.seconds);
  json["ratio"] = to_json(row.ratio);
  json["seconds_ratio"] = to_json(row.seconds_ratio);
  json["remark"] = row.remark;
  return json;
}

std::string line_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-";
}

std::string line_interval(const MaybeInterval& interval) {
  if (!interval) return "-";
  if (!interval->known()) return line_number(interval->mean());
  return fmt::format("{:.3g} [{:.3g}, {:.3g}]", interval->mean(), interval->low(), interval->high());
}

}  // namespace

std::string stand_in_text(const PresetResult& result) {
  const Experiment& experiment = result.experiment;
  if (experiment.stand_in.empty()) return experiment.file;
  return experiment.file + ", in place of the paper's scene: " + experiment.stand_in;
}

std::string preset_csv(const Preset& preset, const std::vector<PresetResult>& results) {
  std::string csv = csv_line({"preset",
                              "hardware_published",
                              "experiment",
                              "scene",
                              "file",
                              "stand_in",
                              "found",
                              "place",
                              "mode",
                              "our_mode",
                              "view",
                              "samples",
                              "baseline_samples",
                              "measure",
                              "published",
                              "published_seconds",
                              "published_ratio",
                              "published_seconds_ratio",
                              "ours",
                              "ours_low",
                              "ours_high",
                              "seconds",
                              "seconds_low",
                              "seconds_high",
                              "ratio",
                              "ratio_low",
                              "ratio_high",
                              "seconds_ratio",
                              "seconds_ratio_low",
                              "seconds_ratio_high",
                              "remark"});
  for (const PresetResult& result : results) {
    for (const PresetRow& row : result.rows) {
      const Experiment& experiment = result.experiment;
      std::vector<std::string> cells{preset.name,
                                     preset.hardware,
                                     experiment.name,
                                     experiment.scene,
                                     experiment.file,
                                     experiment.stand_in,
                                     result.file.empty() ? "0" : "1",
                                     row.published ? row.published->place : "",
                                     row.mode,
                                     row.our_mode,
                                     row.view,
                                     std::to_string(row.samples),
                                     std::to_string(row.baseline_samples),
                                     row.measure,
                                     row.published ? exact(row.published->value) : "",
                                     row.published ? exact(row.published->seconds) : "",
                                     exact(row.published_ratio),
                                     exact(row.published_seconds_ratio)};
      for (const MaybeInterval& interval : {row.ours, row.seconds, row.ratio, row.seconds_ratio})
        add_interval(cells, interval);
      cells.push_back(row.remark);
      csv += csv_line(cells);
    }
  }
  return csv;
}

std::vector<std::string> preset_lines(const std::vector<PresetResult>& results) {
  using Cells = std::array<std::string, 8>;
  std::vector<std::string> lines;
  for (const PresetResult& result : results) {
    lines.push_back(fmt::format("{}: {} ({})", result.experiment.name, result.experiment.scene, stand_in_text(result)));
    if (!result.problem.empty()) lines.push_back("  " + result.problem);
    std::vector<Cells> rows{{"mode", "samples", "measure", "published", "ours", "published ratio", "our ratio", ""}};
    for (const PresetRow& row : result.rows) {
      const std::string samples = row.samples > 0 ? std::to_string(row.samples) : "-";
      rows.push_back({row.view.empty() ? row.mode : row.mode + " (" + row.view + ")", samples, row.measure,
                      line_number(row.published ? row.published->value : kUnpublished), line_interval(row.ours),
                      line_number(row.published_ratio), line_interval(row.ratio),
                      row.remark == result.problem ? "" : row.remark});
    }
    std::array<std::size_t, 7> widths{};
    for (const Cells& row : rows)
      for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
    for (const Cells& row : rows) {
      std::string line = " ";
      for (std::size_t i = 0; i < widths.size(); ++i) line += fmt::format(" {:<{}} ", row[i], widths[i]);
      line += row.back();
      line.erase(line.find_last_not_of(' ') + 1);
      lines.push_back(line);
    }
  }
  return lines;
}

void add_preset(Json& json, const Preset& preset, const std::vector<PresetResult>& results) {
  json["preset"] = preset.name;
  json["paper"] = preset.paper;
  json["hardware"] = preset.hardware;
  json["notes"] = preset.notes;
  json["experiments"] = Json::array();
  for (const PresetResult& result : results) {
    Json entry;
    entry["name"] = result.experiment.name;
    entry["scene"] = result.experiment.scene;
    entry["file"] = result.experiment.file;
    entry["stand_in"] = result.experiment.stand_in;
    entry["found"] = result.file.empty() ? Json(nullptr) : Json(result.file);
    entry["folder"] = result.folder;
    entry["problem"] = result.problem.empty() ? Json(nullptr) : Json(result.problem);
    entry["rows"] = Json::array();
    for (const PresetRow& row : result.rows) entry["rows"].push_back(to_json(row));
    json["experiments"].push_back(entry);
  }
}

const char* const kPresetJsonHelp =
    "With --preset and --json, stdout holds one object: preset, paper, hardware (the paper's), notes, experiments:\n"
    "[{name, scene (the paper's), file, stand_in, found (path, or null), folder, problem, rows: [{mode (the paper's\n"
    "word), our_mode (null: missing), view, samples, baseline_samples, measure, published, published_seconds, place,\n"
    "published_ratio, published_seconds_ratio, ours, seconds, ratio, seconds_ratio (each {mean, low, high} or null),\n"
    "remark}]}], output, page, csv, partial; on failure also error and exit_code.\n";

}  // namespace helio::cli
