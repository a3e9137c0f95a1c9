#include "client/cli/presets/preset_run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <system_error>

#include "client/cli/exit_code.h"
#include "client/cli/presets/preset_output.h"
#include "client/comparison/comparison_folder.h"
#include "client/comparison/comparison_record.h"
#include "renderer/codec/atomic_file.h"

namespace helio::cli {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostEntries = 200'000;  // below --scenes
constexpr int kDeepest = 16;                   // folders below --scenes

// Options that a preset takes from the command line for each of its comparisons.
const std::set<std::string> kPassedOn = {
    "--seeds", "--size",     "--samples", "--reference-error", "--reference-samples",
    "--seed",  "--server",   "--wait",    "--threads",         "--token-file",
    "--isa",   "--progress", "--mix",     "--exclusive",       "--common-seeds"};
const std::set<std::string> kOwn = {"--preset", "--scenes", "--only", "--output", "--json"};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  for (std::size_t end; (end = text.find(',', start)) != std::string::npos; start = end + 1)
    parts.push_back(text.substr(start, end - start));
  parts.push_back(text.substr(start));
  return parts;
}

template <class Items>
std::string joined(const Items& items, const char* separator = ",") {
  return fmt::format("{}", fmt::join(items, separator));
}

// The files of these names below the folder; of several with one name the first by path.
Result<std::map<std::string, std::string>> find_scenes(const fs::path& folder, const std::set<std::string>& names) {
  std::map<std::string, std::string> found;
  std::error_code problem;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  std::size_t seen = 0;
  for (; !problem && entry != fs::recursive_directory_iterator(); entry.increment(problem)) {
    if (++seen > kMostEntries) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("'{}' holds more than {} files and folders", folder.string(), kMostEntries),
                   {}};
    }
    if (entry.depth() >= kDeepest) entry.disable_recursion_pending();
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (!names.contains(name) || !entry->is_regular_file(ignored)) continue;
    const std::string path = entry->path().string();
    const auto [known, added] = found.emplace(name, path);
    if (!added) known->second = std::min(known->second, path);
  }
  if (problem)
    return Error{ErrorCode::invalid_argument, "'" + folder.string() + "' cannot be read: " + problem.message(), {}};
  return found;
}

class PresetRun {
 public:
  PresetRun(const PresetOptions& options, const std::vector<GivenOption>& given, fs::path output,
            CommandContext& context, const RunComparison& run)
      : options_(options), given_(given), output_(std::move(output)), context_(context), run_(run) {}

  int run();

 private:
  void read_flags();
  void choose(const Preset& preset);
  bool was_given(const std::string& name) const;
  std::vector<std::string> words_of(const PresetResult& result) const;
  Status write(const std::string& name, const std::string& text) const;
  int compare(PresetResult& result);
  void read_record(PresetResult& result) const;
  int publish(int exit_code);

  const PresetOptions& options_;
  const std::vector<GivenOption>& given_;
  fs::path output_;
  CommandContext& context_;
  const RunComparison& run_;
  Preset preset_;
  std::pair<int, int> size_{0, 0};  // of the pictures
  std::vector<PresetResult> results_;
};

void PresetRun::read_flags() {
  OptionReader& reader = context_.reader;
  const auto name = reader.choice(options_.name, preset_names());
  if (name) preset_ = *find_preset(*name);
  for (const GivenOption& option : given_) {
    if (kPassedOn.contains(option.name) || kOwn.contains(option.name)) continue;
    context_.problems.add(option.name, "does not go with --preset, which chooses it");
  }
  if (!options_.scenes.given()) {
    context_.problems.add("--scenes", "is missing: the folder below which the scenes of --preset are");
  } else if (std::error_code ignored; !fs::is_directory(options_.scenes.text, ignored)) {
    reader.problem(options_.scenes, "'" + options_.scenes.text + "' is no folder");
  }
  if (!name) return;
  size_ = {preset_.width, preset_.height};
  for (const GivenOption& option : given_) {
    if (option.name != "--size" || option.values.empty()) continue;
    const std::string& text = option.values.front();
    const std::size_t cross = text.find('x');
    // The comparison refuses what is no size.
    if (cross != std::string::npos) size_ = {std::atoi(text.c_str()), std::atoi(text.c_str() + cross + 1)};
  }
  choose(preset_);
  if (!context_.problems.empty()) return;
  std::set<std::string> files;
  for (const PresetResult& result : results_)
    for (const SceneFile& file : result.experiment.files) files.insert(file.name);
  const auto found = find_scenes(options_.scenes.text, files);
  if (!found) {
    reader.problem(options_.scenes, found.error().message);
    return;
  }
  for (PresetResult& result : results_) {
    for (const SceneFile& candidate : result.experiment.files) {
      const auto file = found->find(candidate.name);
      if (file == found->end()) continue;
      result.scene = candidate;
      result.file = file->second;
      break;
    }
    if (!result.scene) {
      result.problem =
          fmt::format("missing scene: {} {} below {}", result.experiment.files.size() == 1 ? "no file" : "none of",
                      candidates_text(result.experiment), options_.scenes.text);
    }
  }
}

void PresetRun::choose(const Preset& preset) {
  std::vector<std::string> names, wanted;
  for (const Experiment& experiment : preset.experiments) names.push_back(experiment.name);
  if (options_.only.given()) wanted = split(options_.only.text);
  for (const std::string& name : wanted) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      context_.reader.problem(options_.only, fmt::format("'{}' is none of {}", name, joined(names, ", ")));
  }
  for (const Experiment& experiment : preset.experiments) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), experiment.name) == wanted.end()) continue;
    results_.push_back({experiment, std::nullopt, "", experiment.name, "", {}});
  }
}

bool PresetRun::was_given(const std::string& name) const {
  return std::any_of(given_.begin(), given_.end(), [&](const GivenOption& option) { return option.name == name; });
}

std::vector<std::string> PresetRun::words_of(const PresetResult& result) const {
  const Experiment& experiment = result.experiment;
  std::vector<std::string> words{result.file[0] == '-' ? "./" + result.file : result.file};
  for (const std::string& mode : experiment.modes) words.insert(words.end(), {"--mode", mode});
  std::vector<std::string> measures;
  for (const auto* some : {&experiment.measures, &experiment.also}) {
    for (const std::string& measure : *some) {
      const std::string name = measure.substr(0, measure.find('@'));
      if (is_of_time(name) || std::find(measures.begin(), measures.end(), name) != measures.end()) continue;
      measures.push_back(name);
    }
  }
  words.insert(words.end(), {"--measures", joined(measures)});
  words.insert(words.end(), experiment.words.begin(), experiment.words.end());
  if (experiment.fovea > 0) {
    const auto [width, height] = size_;
    const double x = 0.5 * width, y = 0.5 * height;
    for (const auto& [name, kind] : {std::pair("fovea", "disk"), std::pair("periphery", "outside")}) {
      words.insert(words.end(),
                   {"--region", fmt::format("{}={}:{},{},{}", name, kind, x, y, experiment.fovea * std::hypot(x, y))});
    }
  }
  if (!experiment.path.empty())
    words.insert(words.end(), {"--path", (output_ / (experiment.name + ".path.json")).string()});
  const std::pair<std::string, std::string> defaults[] = {
      {"--samples", joined(experiment.samples)},
      {"--size", fmt::format("{}x{}", preset_.width, preset_.height)},
      {"--reference-error", preset_.reference_error},
      {"--reference-samples", preset_.reference_samples}};
  for (const auto& [name, value] : defaults)
    if (!was_given(name)) words.insert(words.end(), {name, value});
  for (const GivenOption& option : given_) {
    if (!kPassedOn.contains(option.name)) continue;
    words.push_back(option.name);
    words.insert(words.end(), option.values.begin(), option.values.end());
  }
  words.insert(words.end(), {"--output", (output_ / result.folder).string()});
  return words;
}

Status PresetRun::write(const std::string& name, const std::string& text) const {
  return write_file_atomically((output_ / name).string(),
                               {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

int PresetRun::compare(PresetResult& result) {
  const Experiment& experiment = result.experiment;
  if (!experiment.path.empty()) {
    const Status written = write(experiment.name + ".path.json", experiment.path);
    if (!written) return context_.terminal.fail(kFailed, written.error().to_string());
  }
  return run_(words_of(result));
}

// Reads what the folder has, also where the comparison was interrupted.
void PresetRun::read_record(PresetResult& result) const {
  auto record = read_comparison_folder(output_ / result.folder);
  if (!record) {
    result.problem = record.error().to_string();
    return;
  }
  if (!*record) return;
  result.record = std::move(**record);
  const std::uint64_t all = unit_count(result.record->request());
  if (result.problem.empty() && (!result.record->has_table() || result.record->table().partial()))
    result.problem = fmt::format("not complete: {} of {} pictures are measured", result.record->units_size(), all);
}

int PresetRun::publish(int exit_code) {
  for (PresetResult& result : results_) fill_rows(result);
  Json json;
  add_preset(json, preset_, results_);
  json["output"] = output_.string();
  json["page"] = (output_ / "preset.html").string();
  json["csv"] = (output_ / "preset.csv").string();
  json["partial"] = exit_code != kOk;
  for (const auto& [name, text] : {std::pair("preset.html", preset_page(preset_, results_)),
                                   std::pair("preset.csv", preset_csv(preset_, results_))}) {
    const Status written = write(name, text);
    if (!written) return context_.terminal.fail(kFailed, written.error().to_string(), json);
  }
  for (const std::string& line : preset_lines(results_)) context_.terminal.say(line);
  for (const std::string& note : preset_.notes) context_.terminal.say("note: " + note);
  context_.terminal.say("published: " + preset_.hardware);
  context_.terminal.say((output_ / "preset.html").string());
  if (exit_code != kOk)
    return context_.terminal.fail(exit_code, "not every comparison of the preset ended; the table says which", json);
  context_.terminal.result(json);
  return kOk;
}

int PresetRun::run() {
  read_flags();
  if (!context_.problems.empty()) return context_.refuse();
  std::error_code problem;
  fs::create_directory(output_, problem);
  if (problem) {
    context_.problems.add("--output", "the folder '" + output_.string() + "' cannot be made: " + problem.message());
    return context_.refuse();
  }
  int outcome = kOk;
  bool stopped = false;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    PresetResult& result = results_[i];
    if (result.file.empty()) continue;
    if (!stopped) {
      context_.terminal.say(fmt::format("{} ({} of {}): {}, {}", result.experiment.name, i + 1, results_.size(),
                                        result.experiment.scene, stand_in_text(result)));
      const int code = compare(result);
      if (code == kUsage) return code;
      if (code != kOk) result.problem = fmt::format("the comparison failed with exit code {}", code);
      if (outcome == kOk) outcome = code;
      stopped = code != kOk && code != kFailed && code != kSceneRefused;
    } else {
      result.problem = "not compared: the preset was ended before";
    }
    read_record(result);
  }
  return publish(outcome);
}

}  // namespace

void add_preset_options(CLI::App& app, PresetOptions& options) {
  add_text(app, options.name, "--preset", "NAME",
           "Reproduce the tables of a paper instead of comparing a scene: " + joined(preset_names(), ", ") +
               "; described below");
  add_text(app, options.scenes, "--scenes", "FOLDER", "With --preset: where its scenes are looked up, by file name");
  add_text(app, options.only, "--only", "NAME,...",
           "With --preset: the experiments to run, by the names that the table has. Default: all");
}

int run_preset(const PresetOptions& options, const std::vector<GivenOption>& given, const fs::path& output,
               CommandContext& context, const RunComparison& run) {
  return PresetRun(options, given, output, context, run).run();
}

const char* const kPresetHelp =
    "A preset compares what a paper compares and puts its published figures beside ours, in FOLDER/preset.html and\n"
    "FOLDER/preset.csv: schalk (2018: adaptive sampling, reprojection, both), soares (2020: path tracing and\n"
    "bidirectional path tracing), mrad (2022: FLIP). Each experiment is a comparison in a folder of its own below\n"
    "FOLDER, which goes on where it was interrupted. Scenes that are not below --scenes and modes that do not exist\n"
    "are rows that say so. Several scenes of schalk can be written, and stand in for the paper's: python3\n"
    "scenes/generate --scene NAME --output SCENES/NAME.glb in the source, NAME one of box-area, box-69k, box-1m,\n"
    "box-directional, box-point, box-low-roughness, box-glass, courtyard. By default pictures are small and budgets "
    "few (schalk 64x36, soares 96x54, mrad 160x90; at\n"
    "most 64 samples; 5 seeds), so that two cores need some minutes; --size 1920x1080 (schalk: 1280x720), --samples,\n"
    "--reference-error and --reference-samples lead to the paper's own.\n"
    "Example: heliograph compare --preset soares --scenes ~/scenes --only teapot-cornell-box --output soares\n";

}  // namespace helio::cli
