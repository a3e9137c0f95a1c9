#include "client/comparison/comparison_record.h"

#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <set>
#include <sstream>
#include <tuple>

#include "client/enum_names.h"
#include "renderer/base/number_range.h"

namespace helio {

using google::protobuf::util::MessageDifferencer;

namespace {

constexpr std::size_t kMaxShown = 200;  // bytes of what a parser says

std::map<std::string, int> order_of_modes(const pb::CompareRequest& request) {
  std::map<std::string, int> order;
  for (int i = 0; i < request.modes_size(); ++i) order.emplace(request.modes(i).name(), i);
  return order;
}

// The first thing that is wrong with the units; empty: nothing.
std::string check_units(const pb::CompareRecord& record) {
  const pb::CompareRequest& request = record.request();
  const auto modes = order_of_modes(request);
  const std::size_t budgets = budgets_of(request).size();
  std::set<std::tuple<int, std::uint32_t, std::uint32_t, std::uint32_t>> seen;
  for (int i = 0; i < record.units_size(); ++i) {
    const pb::CompareUnit& unit = record.units(i);
    const auto mode = modes.find(unit.mode());
    if (mode == modes.end()) return fmt::format("units/{}/mode: '{}' is no mode of the request", i, unit.mode());
    if (unit.seed_number() < 1 || unit.seed_number() > request.seeds())
      return fmt::format("units/{}/seedNumber: {} is not in [1, {}]", i, unit.seed_number(), request.seeds());
    if (unit.budget() >= budgets) return fmt::format("units/{}/budget: {} is not below {}", i, unit.budget(), budgets);
    if (int(unit.view()) >= view_count(request))
      return fmt::format("units/{}/view: {} is not below {}", i, unit.view(), view_count(request));
    if (!seen.emplace(mode->second, unit.seed_number(), unit.budget(), unit.view()).second)
      return fmt::format("units/{} is there twice", i);
  }
  return {};
}

// A line for each field that differs: "settings.max_segments: 10 -> 5".
std::vector<std::string> differing_fields(const google::protobuf::Message& before,
                                          const google::protobuf::Message& now) {
  MessageDifferencer differencer;
  differencer.set_message_field_comparison(MessageDifferencer::EQUIVALENT);
  std::string report;
  differencer.ReportDifferencesToString(&report);
  differencer.Compare(before, now);
  std::vector<std::string> fields;
  std::istringstream lines(report);
  for (std::string line; std::getline(lines, line);) {
    if (const std::string changed = "modified: "; line.rfind(changed, 0) == 0) line = line.substr(changed.size());
    if (!line.empty()) fields.push_back(line);
  }
  return fields;
}

std::string yes_no(bool value) {
  return value ? "yes" : "no";
}

// Notes pairs of values that differ.
class Differences {
 public:
  explicit Differences(std::vector<std::string>& list) : list_(list) {}

  void compare(const std::string& what, const std::string& before, const std::string& now) {
    if (before != now) list_.push_back(what + ": " + before + " -> " + now);
  }
  void compare_fields(const std::string& what, const google::protobuf::Message& before,
                      const google::protobuf::Message& now) {
    for (const std::string& field : differing_fields(before, now)) {
      // All modes have one size, which is told by itself.
      if (field.rfind("settings.width:", 0) == 0 || field.rfind("settings.height:", 0) == 0) continue;
      list_.push_back(what + " " + field);
    }
  }

 private:
  std::vector<std::string>& list_;
};

std::string names_of(const google::protobuf::RepeatedField<int>& measures) {
  std::string names;
  for (const int measure : measures) {
    names += (names.empty() ? "" : ",") + to_short_name(static_cast<pb::CompareMeasure>(measure));
  }
  return names.empty() ? "all" : names;
}

std::string text_of(const google::protobuf::RepeatedPtrField<pb::CompareRegion>& regions) {
  std::string text;
  for (const pb::CompareRegion& region : regions) {
    if (region.has_disk()) {
      const pb::CompareRegion::Disk& disk = region.disk();
      text += fmt::format("{}{}={}:{},{},{}", text.empty() ? "" : " ", region.name(),
                          disk.outside() ? "outside" : "disk", disk.x(), disk.y(), disk.radius());
      continue;
    }
    const pb::Rect& r = region.rect();
    text += fmt::format("{}{}={},{},{},{}", text.empty() ? "" : " ", region.name(), r.x0(), r.y0(), r.x1(), r.y1());
  }
  return text.empty() ? "none" : text;
}

std::string text_of_gaze(const pb::CompareRequest& request) {
  return request.has_gaze() ? fmt::format("{},{}", request.gaze().x(), request.gaze().y()) : "none";
}

bool has_foveation(const pb::CompareRequest& request) {
  return std::any_of(request.modes().begin(), request.modes().end(),
                     [](const auto& mode) { return mode.settings().foveation() > pb::FOVEATION_NONE; });
}

std::string size_of(const pb::CompareRequest& request) {
  if (request.modes().empty()) return "none";
  const pb::RenderSettings& settings = request.modes(0).settings();
  return fmt::format("{}x{}", settings.width(), settings.height());
}

std::string kind_of_budgets(const pb::CompareRequest& request) {
  return request.times_s().empty() ? "samples" : "seconds";
}

void compare_references(const pb::CompareRecord& record, const ComparisonCall& call, Differences& differences) {
  const bool was_loaded = !record.reference_files().empty(), is_loaded = !call.reference_files.empty();
  differences.compare("reference", was_loaded ? "files" : "rendered", is_loaded ? "files" : "rendered");
  if (was_loaded && is_loaded) {
    for (int view = 0; view < std::min(record.reference_files_size(), int(call.reference_files.size())); ++view) {
      const auto &before = record.reference_files(view), &now = call.reference_files[view];
      if (before.sha256() != now.sha256())
        differences.compare(fmt::format("reference of view {}", view), before.path(), now.path() + " (other contents)");
    }
  }
  if (!was_loaded && !is_loaded) {
    differences.compare_fields("reference", record.request().reference().rendered(),
                               call.request.reference().rendered());
  }
}

// The call would compare with the references that the record has.
bool has_references_of(const pb::CompareRecord& record, const ComparisonCall& call) {
  const pb::CompareRequest &before = record.request(), &now = call.request;
  std::vector<std::string> differences;
  Differences found(differences);
  compare_references(record, call, found);
  found.compare("size", size_of(before), size_of(now));
  found.compare("scene", before.scene_id(), now.scene_id());
  found.compare("views", std::to_string(view_count(before)), std::to_string(view_count(now)));
  for (int i = 0; i < std::min(before.views_size(), now.views_size()); ++i)
    found.compare_fields("view", before.views(i), now.views(i));
  // Units that are there stay compared with them, whatever build rendered them.
  if (record.units().empty() && !record.calls().empty()) {
    const pb::CompareRecord::Call& last = record.calls(record.calls_size() - 1);
    found.compare("build", last.version() + last.build() + last.isa(), call.version + call.build + call.isa);
  }
  return differences.empty();
}

void drop_references(pb::CompareRecord& record) {
  record.clear_references();
  auto& pictures = *record.mutable_pictures();
  pictures.erase(
      std::remove_if(pictures.begin(), pictures.end(), [](const auto& picture) { return picture.reference(); }),
      pictures.end());
}

// Without a unit a record holds at most its references.
void keep_references_alone(pb::CompareRecord& record) {
  pb::CompareRecord before;
  before.Swap(&record);
  record.mutable_references()->Swap(before.mutable_references());
  for (const pb::CompareRecord::Picture& picture : before.pictures())
    if (picture.reference()) *record.add_pictures() = picture;
}

void add_new_modes(pb::CompareRequest& request, const pb::CompareRequest& before) {
  const auto names = order_of_modes(request);
  for (const pb::CompareMode& mode : before.modes()) {
    if (!names.contains(mode.name())) *request.add_modes() = mode;
  }
}

// The budgets of both, rising.
std::vector<double> joined(std::vector<double> budgets, const std::vector<double>& more) {
  budgets.insert(budgets.end(), more.begin(), more.end());
  std::sort(budgets.begin(), budgets.end());
  budgets.erase(std::unique(budgets.begin(), budgets.end()), budgets.end());
  return budgets;
}

std::uint32_t number_of(double budget, const std::vector<double>& budgets) {
  return std::uint32_t(std::lower_bound(budgets.begin(), budgets.end(), budget) - budgets.begin());
}

void set_budgets(pb::CompareRequest& request, const std::vector<double>& budgets) {
  const bool seconds = !request.times_s().empty();
  request.clear_samples();
  request.clear_times_s();
  for (const double budget : budgets) {
    if (seconds) {
      request.add_times_s(budget);
    } else {
      request.add_samples(std::uint32_t(budget));
    }
  }
}

std::string now_as_text() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

std::vector<double> budgets_of(const pb::CompareRequest& request) {
  if (!request.times_s().empty()) return {request.times_s().begin(), request.times_s().end()};
  return {request.samples().begin(), request.samples().end()};
}

std::uint64_t unit_count(const pb::CompareRequest& request) {
  return std::uint64_t(request.modes_size()) * request.seeds() * budgets_of(request).size() *
         std::uint64_t(view_count(request));
}

int view_count(const pb::CompareRequest& request) {
  return std::max(1, request.views_size());
}

Result<std::string> comparison_json(const pb::CompareRecord& record) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(record, &text, options);
  if (!status.ok())
    return Error{
        ErrorCode::internal, "the record cannot be written as JSON: " + status.ToString().substr(0, kMaxShown), {}};
  return text;
}

Result<pb::CompareRecord> parse_comparison(const std::string& json, const std::string& name) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  pb::CompareRecord record;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &record, options);
  const auto refuse = [&](const std::string& why) { return Error{ErrorCode::invalid_argument, why, name}; };
  if (!status.ok()) return refuse("is no record of a comparison: " + status.ToString().substr(0, kMaxShown));
  if (record.format() > kComparisonFormat)
    return refuse(fmt::format("is of format {}; this version reads up to {}", record.format(), kComparisonFormat));
  if (record.format() == 0) return refuse("is no record of a comparison: it names no format");
  if (const std::string problem = check_units(record); !problem.empty()) return refuse(problem);
  return record;
}

ComparisonDifferences compare_with_record(const pb::CompareRecord& record, const ComparisonCall& call) {
  ComparisonDifferences found;
  if (record.units().empty()) return found;
  const pb::CompareRequest &before = record.request(), &now = call.request;
  Differences shape(found.of_shape), values(found.of_values);
  shape.compare("picture size", size_of(before), size_of(now));
  shape.compare("unit of budgets", kind_of_budgets(before), kind_of_budgets(now));
  shape.compare("number of views", std::to_string(view_count(before)), std::to_string(view_count(now)));
  shape.compare("measures", names_of(before.measures()), names_of(now.measures()));
  shape.compare("regions", text_of(before.regions()), text_of(now.regions()));

  if (before.scene_id() != now.scene_id()) {
    values.compare("scene", record.scene_file() + " (" + before.scene_id() + ")",
                   call.scene_file + " (" + now.scene_id() + ")");
  }
  const auto modes = order_of_modes(before);
  for (const pb::CompareMode& mode : now.modes()) {
    const auto known = modes.find(mode.name());
    if (known != modes.end()) values.compare_fields("mode " + mode.name(), before.modes(known->second), mode);
  }
  for (int i = 0; i < std::min(before.views_size(), now.views_size()); ++i)
    values.compare_fields(fmt::format("view {}", i), before.views(i), now.views(i));
  if (has_foveation(before) && has_foveation(now)) values.compare("gaze", text_of_gaze(before), text_of_gaze(now));
  values.compare("first seed", std::to_string(before.first_seed()), std::to_string(now.first_seed()));
  values.compare("common seeds", yes_no(before.common_seeds()), yes_no(now.common_seeds()));
  values.compare("exclusive", yes_no(before.exclusive()), yes_no(now.exclusive()));
  compare_references(record, call, values);
  if (record.calls().empty()) return found;
  const pb::CompareRecord::Call& first = record.calls(0);
  values.compare("version", first.version(), call.version);
  values.compare("build", first.build(), call.build);
  values.compare("instruction set", first.isa(), call.isa);
  values.compare("threads", std::to_string(first.threads()), std::to_string(call.threads));
  return found;
}

void extend_record(pb::CompareRecord& record, const ComparisonCall& call, const std::vector<std::string>& differences) {
  if (!has_references_of(record, call)) drop_references(record);
  if (record.units().empty()) keep_references_alone(record);
  record.set_format(kComparisonFormat);
  record.set_scene_name(call.scene_name);
  record.set_scene_file(call.scene_file);
  record.clear_table();

  const pb::CompareRequest before = record.request();
  pb::CompareRequest& request = *record.mutable_request();
  request = call.request;
  request.clear_done();
  if (!has_foveation(request) && before.has_gaze()) *request.mutable_gaze() = before.gaze();
  add_new_modes(request, before);
  request.set_seeds(std::max(before.seeds(), request.seeds()));
  const std::vector<double> old_budgets = budgets_of(before), budgets = joined(old_budgets, budgets_of(request));
  set_budgets(request, budgets);
  for (pb::CompareUnit& unit : *record.mutable_units()) {
    unit.set_budget(number_of(old_budgets[unit.budget()], budgets));
  }
  for (pb::CompareRecord::Picture& picture : *record.mutable_pictures()) {
    if (picture.budget() < old_budgets.size()) picture.set_budget(number_of(old_budgets[picture.budget()], budgets));
  }
  sort_units(record);

  record.clear_reference_files();
  for (const auto& file : call.reference_files) *record.add_reference_files() = file;
  pb::CompareRecord::Call& added = *record.add_calls();
  added.set_command_line(call.command_line);
  added.set_begun(now_as_text());
  added.set_version(call.version);
  added.set_build(call.build);
  added.set_isa(call.isa);
  added.set_threads(call.threads);
  added.set_processor(call.processor);
  for (const std::string& difference : differences) added.add_differences(difference);
}

pb::CompareRequest request_of(const pb::CompareRecord& record) {
  pb::CompareRequest request = record.request();
  for (const pb::CompareUnit& unit : record.units()) {
    pb::CompareUnit& done = *request.add_done();
    done = unit;
    done.clear_worst();  // is no part of the table
  }
  return request;
}

void sort_units(pb::CompareRecord& record) {
  const auto order = order_of_modes(record.request());
  const auto place = [&](const pb::CompareUnit& unit) {
    const auto mode = order.find(unit.mode());
    return std::tuple(mode == order.end() ? record.request().modes_size() : mode->second, unit.seed_number(),
                      unit.budget(), unit.view());
  };
  std::sort(record.mutable_units()->pointer_begin(), record.mutable_units()->pointer_end(),
            [&](const pb::CompareUnit* a, const pb::CompareUnit* b) { return place(*a) < place(*b); });
}

}  // namespace helio
