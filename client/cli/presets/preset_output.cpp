#include "client/cli/presets/preset_output.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/comparison/comparison_csv.h"
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
  json["few_pixels_decide"] = row.few_pixels;
  json["disturbed"] = row.disturbed;
  json["ratio_few_pixels_decide"] = row.ratio_few_pixels;
  json["ratio_disturbed"] = row.ratio_disturbed;
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

std::string marks(bool few_pixels, bool disturbed) {
  return few_pixels ? " (p)" : disturbed ? " (d)" : "";
}

}  // namespace

std::string stand_in_text(const PresetResult& result) {
  if (!result.scene) return "none of the files " + candidates_text(result.experiment);
  if (result.scene->stand_in.empty()) return result.scene->name;
  return result.scene->name + ", in place of the paper's scene: " + result.scene->stand_in;
}

std::string candidates_text(const Experiment& experiment) {
  std::string text;
  for (const SceneFile& file : experiment.files) text += (text.empty() ? "'" : ", '") + file.name + "'";
  return text;
}

const char* const kFewPixelsNote =
    "a few pixels decide. The mean is that of rare, large errors; other seeds may come to quite another.";
const char* const kDisturbedNote =
    "disturbed. Other programs used the processor while one or more units of the point were rendered.";

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
                              "few_pixels_decide",
                              "disturbed",
                              "ratio_few_pixels_decide",
                              "ratio_disturbed",
                              "remark"});
  for (const PresetResult& result : results) {
    for (const PresetRow& row : result.rows) {
      const Experiment& experiment = result.experiment;
      std::vector<std::string> cells{preset.name,
                                     preset.hardware,
                                     experiment.name,
                                     experiment.scene,
                                     result.scene ? result.scene->name : "",
                                     result.scene ? result.scene->stand_in : "",
                                     result.scene ? "1" : "0",
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
      for (const bool flag : {row.few_pixels, row.disturbed, row.ratio_few_pixels, row.ratio_disturbed})
        cells.push_back(flag ? "1" : "0");
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
    if (const auto [some, all] = disturbed_units(result); some > 0) {
      lines.push_back(fmt::format(
          "  disturbed: while {} of {} pictures were rendered, other programs used the processor", some, all));
    }
    bool pixels = false, disturbed = false;
    std::vector<Cells> rows{{"mode", "samples", "measure", "published", "ours", "published ratio", "our ratio", ""}};
    for (const PresetRow& row : result.rows) {
      const std::string samples = row.samples > 0 ? std::to_string(row.samples) : "-";
      const bool of_time = is_of_time(row.measure);
      rows.push_back({row.view.empty() ? row.mode : row.mode + " (" + row.view + ")", samples, row.measure,
                      line_number(row.published ? row.published->value : kUnpublished),
                      line_interval(row.ours) + marks(row.few_pixels, of_time && row.disturbed),
                      line_number(row.published_ratio),
                      line_interval(row.ratio) + marks(row.ratio_few_pixels, of_time && row.ratio_disturbed),
                      row.remark == result.problem ? "" : row.remark});
      pixels |= row.few_pixels || row.ratio_few_pixels;
      disturbed |= of_time && (row.disturbed || row.ratio_disturbed);
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
    if (pixels) lines.push_back(std::string("  (p): ") + kFewPixelsNote);
    if (disturbed) lines.push_back(std::string("  (d): ") + kDisturbedNote);
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
    entry["file"] = result.scene ? Json(result.scene->name) : Json(nullptr);
    entry["stand_in"] = result.scene ? result.scene->stand_in : "";
    entry["files"] = Json::array();
    for (const SceneFile& file : result.experiment.files) entry["files"].push_back(file.name);
    entry["disturbed"] = disturbed_units(result).first;
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
    "[{name, scene (the paper's), file (that was found, or null), stand_in (empty: it is the paper's scene), files\n"
    "(that are looked up), disturbed (pictures), found (path, or null), folder, problem, rows: [{mode (the paper's\n"
    "word), our_mode (null: missing), view, samples, baseline_samples, measure, published, published_seconds, place,\n"
    "published_ratio, published_seconds_ratio, ours, seconds, ratio, seconds_ratio (each {mean, low, high} or null),\n"
    "few_pixels_decide, disturbed, ratio_few_pixels_decide, ratio_disturbed, remark}]}], output, page, csv, partial; "
    "on failure also error and exit_code.\n";

}  // namespace helio::cli
