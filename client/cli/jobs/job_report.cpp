#include "client/cli/jobs/job_report.h"

#include <google/protobuf/util/json_util.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "client/cli/commands/render_report.h"
#include "client/enum_names.h"
#include "client/jobs/job_board.h"
#include "client/jobs/job_client.h"

namespace helio::cli {

namespace {

constexpr std::size_t kShortId = 10;
constexpr std::size_t kNameColumn = 24;
constexpr int kBar = 10;

Json time_or_null(double unix_s) {
  return unix_s > 0 ? Json(unix_s) : Json(nullptr);
}

Json as_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions names;
  names.preserve_proto_field_names = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, names).ok()) return nullptr;
  return Json::parse(text, nullptr, false);
}

Json to_json(const pb::JobView& view) {
  Json json;
  json["view"] = view.view();
  json["file"] = view.file().empty() ? Json(nullptr) : Json(view.file());
  json["bytes"] = view.bytes();
  json["sha256"] = view.sha256();
  add_frame_end(json, view.end());
  return json;
}

// Whole percents, and 100 for what is done alone. Empty: not known, of a job that has run and does not.
std::string percent(const pb::Job& job) {
  const bool known = job.has_progress() || job.views_done() > 0 || job.attempt() == 0 ||
                     job.state() == pb::JOB_STATE_RUNNING || job.state() == pb::JOB_STATE_SUCCEEDED;
  if (!known) return {};
  return fmt::format("{} %", int(std::floor(100 * done_share(job) + 1e-9)));
}

std::string views_text(const pb::Job& job) {
  return job.views() > 1 ? fmt::format("{}/{} views", job.views_done(), job.views()) : std::string();
}

std::string age_text(const pb::Job& job, double now_s) {
  const double age = std::max(0.0, now_s - job.submitted_s());
  if (age < 60) return fmt::format("{:.0f} s", std::floor(age));
  if (age < 3600) return fmt::format("{:.0f} min", std::floor(age / 60));
  if (age < 48 * 3600) return fmt::format("{:.0f} h", std::floor(age / 3600));
  return fmt::format("{:.0f} d", std::floor(age / 86400));
}

std::size_t width_of(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xc0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t width) {
  const std::size_t have = width_of(text);
  return have < width ? text + std::string(width - have, ' ') : text;
}

// Columns as wide as their widest cell; the last one takes what is left.
std::vector<std::string> lay_out(const std::vector<std::vector<std::string>>& rows, int columns) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += i + 1 < row.size() ? padded(row[i], widths[i]) + "  " : row[i];
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(columns > 0 ? fit(line, std::size_t(columns)) : line);
  }
  return lines;
}

std::string name_or_scene(const pb::Job& job) {
  return fit(job.name().empty() ? "scene " + job.scene_id().substr(0, 8) : job.name(), kNameColumn);
}

std::string reason_text(const pb::Job& job) {
  std::string text = single_line(job.reason());
  if (job.state() == pb::JOB_STATE_RUNNING && job.target_state() != pb::JOB_STATE_SUCCEEDED &&
      job.target_state() != pb::JOB_STATE_UNSPECIFIED)
    text = "will be " + state_name(job.target_state()) + (text.empty() ? "" : "; " + text);
  return text;
}

}  // namespace

std::string state_name(pb::JobState state) {
  return to_short_name(state);
}

std::vector<std::string> state_names() {
  return short_names(*pb::JobState_descriptor());
}

std::string fit(const std::string& raw, std::size_t width) {
  const std::string text = single_line(raw);
  if (width_of(text) <= width) return text;
  const std::size_t kept = width > 3 ? width - 3 : 0;
  std::size_t end = 0, characters = 0;
  while (end < text.size()) {
    if ((static_cast<unsigned char>(text[end]) & 0xc0) != 0x80 && characters++ == kept) break;
    ++end;
  }
  return text.substr(0, end) + std::string(std::min<std::size_t>(width, 3), '.');
}

std::string bar(double share, int width) {
  const int done = int(std::floor(std::clamp(share, 0.0, 1.0) * width + 1e-9));
  return "[" + std::string(std::size_t(done), '#') + std::string(std::size_t(width - done), '-') + "]";
}

std::vector<std::string> short_ids(const std::vector<pb::Job>& jobs) {
  std::vector<std::string> sorted;
  for (const pb::Job& job : jobs) sorted.push_back(job.job_id());
  std::sort(sorted.begin(), sorted.end());
  std::size_t length = kShortId;
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
    std::size_t common = 0;
    const std::string &a = sorted[i], &b = sorted[i + 1];
    while (common < a.size() && common < b.size() && a[common] == b[common]) ++common;
    if (a != b) length = std::max(length, common + 1);
  }
  std::vector<std::string> ids;
  for (const pb::Job& job : jobs) ids.push_back(job.job_id().substr(0, length));
  return ids;
}

std::string left_text(const pb::Job& job) {
  if (!job.has_left()) return {};
  return fmt::format("{} ({} to {})", human_seconds(job.left().seconds()), human_seconds(job.left().low_s()),
                     human_seconds(job.left().high_s()));
}

Json to_json(const pb::Job& job) {
  const pb::Progress& progress = job.progress();
  Json json;
  json["job_id"] = job.job_id();
  json["name"] = job.name();
  json["state"] = state_name(job.state());
  json["target_state"] = state_name(job.target_state());
  json["reason"] = job.reason();
  json["scene_id"] = job.scene_id();
  json["priority"] = job.priority();
  json["attempt"] = job.attempt();
  json["views"] = job.views();
  json["views_done"] = job.views_done();
  json["done"] = done_share(job);
  json["submitted_s"] = time_or_null(job.submitted_s());
  json["started_s"] = time_or_null(job.started_s());
  json["ended_s"] = time_or_null(job.ended_s());
  json["checkpoint_s"] = time_or_null(job.checkpoint_s());
  json["same_bits"] = job.same_bits();
  json["require_same_bits"] = job.require_same_bits();
  json["owner"] = job.owner().empty() ? Json(nullptr) : Json(job.owner());
  json["output"] = job.has_output() ? Json(job.output().path()) : Json(nullptr);
  json["samples"] = job.has_progress() ? Json(progress.samples_per_pixel()) : Json(nullptr);
  json["samples_per_second"] = job.has_progress() ? Json(progress.samples_per_second()) : Json(nullptr);
  json["estimated_rmse"] = progress.error().known() ? Json(progress.error().rmse()) : Json(nullptr);
  json["left_s"] = nullptr;
  if (job.has_left()) {
    json["left_s"] = {{"estimate", job.left().seconds()}, {"low", job.left().low_s()}, {"high", job.left().high_s()}};
  }
  json["width"] = job.settings().width();
  json["height"] = job.settings().height();
  json["settings"] = as_json(job.settings());
  json["budget"] = as_json(job.budget());
  json["results"] = Json::array();
  for (const pb::JobView& view : job.results()) json["results"].push_back(to_json(view));
  return json;
}

std::string describe_progress(const pb::Job& job) {
  std::string text = state_name(job.state());
  if (is_over(job.state()) && job.state() != pb::JOB_STATE_SUCCEEDED) return text;
  if (const std::string done = percent(job); !done.empty()) text += ", " + done;
  if (const std::string views = views_text(job); !views.empty()) text += ", " + views;
  if (job.state() != pb::JOB_STATE_RUNNING) return text;
  if (job.has_progress()) {
    text += fmt::format(", {} samples, {} samples/s", job.progress().samples_per_pixel(),
                        human_count(job.progress().samples_per_second()));
    if (job.progress().error().known()) text += fmt::format(", error {:.3g}", job.progress().error().rmse());
  }
  if (const std::string left = left_text(job); !left.empty()) text += ", " + left + " left";
  return text;
}

std::string describe(const pb::JobEvent& event) {
  std::string text = event.from() == pb::JOB_STATE_UNSPECIFIED
                         ? "submitted, " + state_name(event.to())
                         : state_name(event.from()) + " -> " + state_name(event.to());
  if (event.to() == pb::JOB_STATE_RUNNING && event.attempt() > 1) text += fmt::format(" (attempt {})", event.attempt());
  if (!event.reason().empty()) text += ": " + single_line(event.reason());
  if (!event.by().empty()) text += ", by " + single_line(event.by());
  return text;
}

std::vector<std::string> describe(const pb::Job& job, double now_s) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("job {}{}: {}", job.job_id(),
                              job.name().empty() ? "" : " '" + single_line(job.name()) + "'", describe_progress(job)));
  if (const std::string reason = reason_text(job); !reason.empty()) lines.push_back("  " + reason);
  std::string budget;
  if (job.budget().samples() > 0) budget += fmt::format(", {} samples", job.budget().samples());
  if (job.budget().time_s() > 0) budget += ", " + human_seconds(job.budget().time_s());
  if (job.budget().error() > 0) budget += fmt::format(", error {:g}", job.budget().error());
  lines.push_back(fmt::format("  scene {}, {}x{}, mode {}, integrator {}, to{}", job.scene_id(), job.settings().width(),
                              job.settings().height(), to_short_name(job.settings().mode()),
                              to_short_name(job.settings().integrator()), budget.empty() ? "" : budget.substr(1)));
  lines.push_back(fmt::format("  priority {}, attempt {}, submitted {} ago{}{}", job.priority(), job.attempt(),
                              age_text(job, now_s), job.owner().empty() ? "" : " by " + single_line(job.owner()),
                              job.require_same_bits() ? ", requires the same bits" : ""));
  if (!is_over(job.state()) && job.checkpoint_s() > 0) {
    lines.push_back("  newest checkpoint " + human_seconds(std::max(0.0, now_s - job.checkpoint_s())) + " ago");
  }
  if (!job.same_bits())
    lines.push_back("  not bit-equal to an uninterrupted run: rendered by different builds or instruction paths");
  if (job.has_output()) lines.push_back("  writes " + job.output().path() + " on the daemon's machine");
  for (const pb::JobView& view : job.results()) {
    lines.push_back(fmt::format("  view {}: {}, {}B{}", view.view(), describe_end(view.end()),
                                human_count(double(view.bytes())), view.file().empty() ? "" : ", in " + view.file()));
  }
  return lines;
}

std::vector<std::string> job_table(const std::vector<pb::Job>& jobs, double now_s, int columns) {
  const std::vector<std::string> ids = short_ids(jobs);
  std::vector<std::vector<std::string>> rows = {{"JOB", "NAME", "STATE", "DONE", "PRIORITY", "AGE", "REASON"}};
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const pb::Job& job = jobs[i];
    const std::string views = views_text(job), done = percent(job);
    rows.push_back({ids[i], name_or_scene(job), state_name(job.state()),
                    done + (views.empty() || done.empty() ? "" : ", ") + views, std::to_string(job.priority()),
                    age_text(job, now_s), reason_text(job)});
  }
  return lay_out(rows, columns);
}

std::vector<std::string> live_table(const std::vector<pb::Job>& jobs, double now_s, int columns) {
  const std::vector<std::string> ids = short_ids(jobs);
  std::vector<std::vector<std::string>> rows = {
      {"JOB", "NAME", "STATE", "DONE", "LEFT", "SAMPLES/S", "AGE", "PRIORITY", "REASON"}};
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const pb::Job& job = jobs[i];
    const bool running = job.state() == pb::JOB_STATE_RUNNING;
    const std::string done = percent(job);
    rows.push_back({ids[i], name_or_scene(job), state_name(job.state()),
                    done.empty() ? "" : bar(done_share(job), kBar) + " " + done, running ? left_text(job) : "",
                    running && job.has_progress() ? human_count(job.progress().samples_per_second()) : "",
                    age_text(job, now_s), std::to_string(job.priority()), reason_text(job)});
  }
  return lay_out(rows, columns);
}

}  // namespace helio::cli
