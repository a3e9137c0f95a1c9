// heliograph compare: sampling modes against a reference, error by time and samples, over seeds.
#include <google/protobuf/util/message_differencer.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <set>
#include <system_error>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/commands/compare_report.h"
#include "client/cli/commands/compare_script.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/path_option.h"
#include "client/cli/compare_modes.h"
#include "client/cli/comparison_table.h"
#include "client/cli/exit_code.h"
#include "client/cli/foveation_options.h"
#include "client/cli/interrupt.h"
#include "client/cli/presets/preset_output.h"
#include "client/cli/presets/preset_run.h"
#include "client/cli/scene_options.h"
#include "client/cli/shell_word.h"
#include "client/comparison/comparison_folder.h"
#include "client/comparison/comparison_record.h"
#include "client/enum_names.h"
#include "client/report/comparison_report.h"
#include "renderer/base/clock.h"
#include "renderer/codec/atomic_file.h"
#include "renderer/codec/sha256.h"
#include "server/app/machine_info.h"

namespace helio::cli {

namespace fs = std::filesystem;
namespace pb = heliograph::v1;

namespace {

constexpr std::size_t kMaxViews = 1000;

struct CompareOptions {
  SceneOptions scene;
  CompareModeOptions modes;
  CompareScriptOptions script;
  TextOption path, output, oidn_library;
  bool mix = false;
  PresetOptions preset;
  CommonOptions common;
};

// A comparison of a preset, whose own output it stays out of.
struct PresetPart {
  std::string command_line;  // that the record names
  bool json = false;         // the preset's result is JSON, alone on stdout
};

constexpr const char* kHelp =
    "Renders every mode with every seed to every budget, in turns, and measures how far each picture is from the\n"
    "reference.\n";
constexpr const char* kFolderHelp =
    "FOLDER gets comparison.json (all units, while they come), units.csv, points.csv, ratios.csv, report.html, and\n"
    "pictures/reference.viewN.exr and pictures/MODE.viewN.exr (first seed, last budget; radiance as float). The same\n"
    "command with the same folder goes on where it was interrupted. It measures no picture twice, but a still's grows\n"
    "from budget to budget, so that for a later budget those before it are rendered again. More seeds, budgets or\n"
    "modes are added to those that are there. Settings, scene, build, instruction set or threads that differ are\n"
    "refused, each named, unless --mix is given; the record then says what was mixed. A comparison that ends early\n"
    "(Ctrl-C, a failure) leaves the tables and the report of its units so far, marked as partial.\n";
constexpr const char* kEndHelp =
    "Ctrl-C ends the comparison and keeps the units so far; a second Ctrl-C ends at once.\n"
    "Example: heliograph compare room.glb --size 320x240 --modes pt,combined,pt+bdpt --samples 1..64 --output room\n"
    "Example: heliograph compare room.glb --path orbit --modes pt,combined,preview --time 0.05,0.1 --output orbit\n\n";

std::vector<std::string> own_words() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

// The words as one line, quoted for a shell where they have to be.
std::string command_line(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + shell_word(word);
  return as_utf8(line);
}

// A folder that exists and can be written, or can be made inside one that does.
fs::path read_folder(const TextOption& option, OptionReader& reader) {
  if (!option.given()) {
    reader.problems().add("--output", "is missing: the folder to keep the comparison in");
    return {};
  }
  fs::path folder(reader.text(option).value_or(""));
  if (folder.empty()) return {};
  if (!folder.has_filename()) folder = folder.parent_path();  // a slash at the end
  std::error_code ignored;
  const fs::path parent = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  const auto unwritable = [&](const fs::path& where) {
    return ::access(where.c_str(), W_OK | X_OK) == 0
               ? std::string()
               : "the folder '" + where.string() + "' cannot be written: " + std::strerror(errno);
  };
  std::string problem;
  if (fs::is_directory(folder, ignored)) {
    problem = unwritable(folder);
  } else if (fs::exists(folder, ignored)) {
    problem = "'" + folder.string() + "' is a file; allowed: a folder, or a new one's name";
  } else if (!fs::is_directory(parent, ignored)) {
    problem = "the folder '" + parent.string() + "' does not exist";
  } else {
    problem = unwritable(parent);
    std::error_code making;  // some file systems tell no sooner
    if (problem.empty() && fs::create_directory(folder, making)) fs::remove(folder, ignored);
    if (making) problem = "the folder '" + folder.string() + "' cannot be made: " + making.message();
  }
  if (!problem.empty()) reader.problem(option, problem);
  return folder;
}

// Open Image Denoise for modes that need it: the daemon has its own.
void read_oidn(const CompareOptions& options, const std::vector<ChosenMode>& modes, Connection& connection,
               OptionReader& reader) {
  const bool in_process = connection.address.empty();
  const bool needed = std::any_of(modes.begin(), modes.end(), [](const ChosenMode& mode) { return mode.needs_oidn(); });
  const auto given = reader.text(options.oidn_library);
  if (given && !in_process) reader.problem(options.oidn_library, "does not go with --server: the daemon has its own");
  if (given && !needed) reader.problem(options.oidn_library, "is only valid with a mode oidn");
  if (!needed || !in_process) return;
  const char* const variable = std::getenv("HELIOGRAPH_OIDN");
  connection.oidn_library = given.value_or(variable ? variable : "");
  if (connection.oidn_library.empty())
    reader.problems().add("--modes",
                          "'oidn' needs Open Image Denoise, whose libOpenImageDenoise.so --oidn-library or "
                          "HELIOGRAPH_OIDN has to name");
}

// The command's way from its flags to the table.
class Comparing {
 public:
  // `part`: of a preset; it outlives this. nullptr: the command's own.
  Comparing(const CLI::App& app, const CompareOptions& options, const PresetPart* part)
      : options_(options), part_(part), context_(app, options.common), terminal_(context_.terminal) {
    if (part) terminal_.keep_results();
  }

  int run();

 private:
  bool read_flags();
  int render(const Interrupt& interrupt);
  bool check_server(const pb::GetServerInfoResponse& info);
  bool plan(const pb::GetServerInfoResponse& info, const pb::LoadSceneResponse& loaded);
  std::vector<pb::CameraView> play(const pb::SceneInfo& scene, const pb::SceneCamera& camera);
  void check_files();
  bool grow_record();
  bool lock_folder();
  Result<std::vector<std::string>> upload_references(RenderClient& client, const std::vector<std::string>& files);
  Result<std::vector<std::string>> upload_kept_references(RenderClient& client, ComparisonFolder& folder);
  Result<pb::CompareResponse::Result> compare(RenderClient& client, ComparisonFolder& folder);
  int finish(const Interrupt& interrupt, ComparisonFolder& folder, const Result<pb::CompareResponse::Result>& result,
             Json json);
  Status write_report(const pb::CompareRecord& record, Json& json);

  const CompareOptions& options_;
  const PresetPart* part_;
  CommandContext context_;
  Terminal& terminal_;
  CallControl control_;

  SceneChoice scene_;
  std::vector<ChosenMode> modes_;
  std::string path_text_;
  fs::path folder_;
  std::optional<ComparisonLock> lock_;
  ReferenceFiles references_;
  std::pair<int, int> size_{0, 0};
  std::optional<pb::CompareRecord> kept_;  // that the folder holds
  ComparisonCall call_;
  pb::CompareRecord record_;
  bool whole_ = false;  // the folder has all of it, pictures included
};

bool Comparing::read_flags() {
  OptionReader& reader = context_.reader;
  for (const TextOption* option : {&options_.preset.scenes, &options_.preset.only})
    if (option->given()) reader.problem(*option, "is only valid with --preset");
  scene_ = read_scene(options_.scene, options_.common.connection, reader);
  modes_ = read_compare_modes(options_.modes, context_.problems);
  const bool path = options_.path.given();
  for (const ChosenMode& mode : modes_) {
    if (mode.needs_path() && !path)
      context_.problems.add("--modes",
                            "'" + mode.message().name() + "' shows previews along a path, which --path gives");
  }
  path_text_ = read_path_file(options_.path, reader);
  if (is_path_by_name(options_.path)) {
    const auto named = named_path(options_.path.text, 1);
    if (named && named->amounts.size() > kMaxViews)
      reader.problem(options_.path, fmt::format("'{}' has {} views; allowed: at most {}", options_.path.text,
                                                named->amounts.size(), kMaxViews));
  }
  read_compare_script(options_.script, options_.modes.common.seed, path, reader, call_.request);
  read_oidn(options_, modes_, context_.connection, reader);
  context_.connection.vulkan_devices = std::any_of(
      modes_.begin(), modes_.end(), [](const ChosenMode& mode) { return asks_for_device(mode.message().settings()); });
  context_.connection.allow_exclusive = options_.script.exclusive;
  references_ = read_reference_files(options_.script, reader);
  Problems told;  // of the size, with the modes
  size_ = OptionReader(told).size(options_.modes.common.size).value_or(std::pair(0, 0));
  if (references_.given()) {
    const auto found = check_reference(references_, 0, size_, reader, options_.script.reference);
    if (found) size_ = *found;
  }
  check_regions(call_.request, size_.first, size_.second, context_.problems);
  folder_ = read_folder(options_.output, reader);
  std::error_code problem;
  if (fs::is_directory(folder_, problem) && ::access(folder_.c_str(), W_OK | X_OK) == 0) lock_folder();
  if (!folder_.empty()) {
    auto kept = read_comparison_folder(folder_);
    if (!kept) context_.problems.add("--output", kept.error().to_string());
    if (kept) kept_ = std::move(*kept);
    check_files();
  }
  if (context_.problems.empty()) return true;
  // Alone it is told when the scene is loaded, with the exit code of that.
  const bool missing = options_.scene.file.given() && !scene_.on_server && !scene_.local &&
                       scene_.local.error().code == ErrorCode::not_found;
  if (missing) context_.problems.add("FILE", scene_.local.error().to_string());
  return false;
}

bool Comparing::lock_folder() {
  auto lock = ComparisonLock::take(folder_);
  if (!lock) {
    context_.problems.add("--output", lock.error().to_string());
    return false;
  }
  lock_ = std::move(*lock);
  if (!lock_->effective()) {
    terminal_.warn("the file system of '" + folder_.string() +
                   "' knows no locks: another comparison in this folder at the same time would lose pictures");
  }
  return true;
}

// Nothing that is read may be overwritten.
void Comparing::check_files() {
  OutputCheck outputs;
  outputs.add_inputs(scene_);
  add_path_input(options_.path, outputs);
  const int views = std::max(1, call_.request.views_size());
  if (references_.given())
    for (int view = 0; view < views; ++view) outputs.add_input(references_.file(view), "a reference");
  for (const char* name : {"comparison.json", "units.csv", "points.csv", "ratios.csv", "report.html"})
    outputs.check("--output", (folder_ / name).string(), context_.problems);
  for (int view = 0; view < views; ++view) {
    pb::CompareRecord::Picture picture;
    picture.set_view(std::uint32_t(view));
    std::set<std::string> names;
    for (const ChosenMode& mode : modes_) {
      if (!names.insert(mode.message().name()).second) continue;  // has been told
      picture.set_mode(mode.message().name());
      outputs.check("--output", (folder_ / picture_file(picture)).string(), context_.problems);
    }
    picture.set_reference(true);
    outputs.check("--output", (folder_ / picture_file(picture)).string(), context_.problems);
  }
}

bool Comparing::check_server(const pb::GetServerInfoResponse& info) {
  for (const ChosenMode& mode : modes_) mode.check_against_server(info, context_.problems);
  return context_.problems.empty();
}

std::vector<pb::CameraView> Comparing::play(const pb::SceneInfo& scene, const pb::SceneCamera& camera) {
  if (!options_.path.given()) return {camera.view()};
  const PathStart start{camera.view(), centre_of(scene), cameras_of(scene)};
  const auto views = read_path_views(options_.path, path_text_, {}, start);
  std::vector<pb::CameraView> cameras;
  if (!views) {
    context_.problems.add("--path", views.error().to_string());
    return cameras;
  }
  const auto own = std::find_if(views->begin(), views->end(), [](const PathView& view) { return bool(view.budget); });
  if (own != views->end()) {
    context_.reader.problem(options_.path, fmt::format("view {} has a budget of its own; those of a comparison are "
                                                       "--samples or --time",
                                                       own - views->begin()));
  }
  if (views->size() < 2 || views->size() > kMaxViews) {
    context_.reader.problem(options_.path, fmt::format("{} views; allowed: [2, {}]", views->size(), kMaxViews));
    return cameras;
  }
  for (const PathView& view : *views) cameras.push_back(view.camera);
  return cameras;
}

// Makes the request whole by what server and scene say, and joins it with what the folder holds.
bool Comparing::plan(const pb::GetServerInfoResponse& info, const pb::LoadSceneResponse& loaded) {
  Problems& problems = context_.problems;
  const pb::SceneInfo& scene = loaded.scene();
  const pb::SceneCamera* const camera = choose_camera(options_.modes.common, scene, context_.reader);
  if (!camera) return false;
  pb::CompareRequest& request = call_.request;
  request.set_scene_id(scene.scene_id());
  for (ChosenMode& mode : modes_) {
    if (size_.first > 0) {
      mode.message().mutable_settings()->set_width(size_.first);
      mode.message().mutable_settings()->set_height(size_.second);
    }
    mode.complete(scene, *camera);
    mode.check_against_server(info, problems);
    *request.add_modes() = mode.message();
  }
  if (!problems.empty()) return false;
  const pb::RenderSettings& first = request.modes(0).settings();
  size_ = {first.width(), first.height()};
  for (const pb::CameraView& view : play(scene, *camera)) *request.add_views() = view;
  if (!problems.empty()) return false;
  if (references_.given()) {
    for (int view = 0; view < request.views_size(); ++view)
      check_reference(references_, view, size_, context_.reader, options_.script.reference);
  } else {
    pb::RenderSettings& settings = *request.mutable_reference()->mutable_rendered()->mutable_settings();
    settings = reference_settings(first);
    if (options_.script.reference_integrator.given())
      settings.set_integrator(*from_short_name<pb::Integrator>(options_.script.reference_integrator.text));
  }
  const bool foveated = std::any_of(request.modes().begin(), request.modes().end(), [](const pb::CompareMode& mode) {
    return mode.settings().foveation() > pb::FOVEATION_NONE;
  });
  if (options_.script.gaze.given() && !foveated)
    context_.reader.problem(options_.script.gaze, "is only valid with a mode that has foveation");
  if (foveated && !request.has_gaze()) *request.mutable_gaze() = centre_of_film(first);
  check_regions(request, size_.first, size_.second, problems);
  check_files();
  if (!problems.empty()) return false;

  call_.scene_name = scene.name();
  call_.scene_file = as_utf8(scene_.file);
  call_.command_line = part_ ? part_->command_line : command_line(own_words());
  call_.version = info.version();
  call_.build = info.build();
  call_.isa = info.isa();
  call_.threads = info.threads();
  if (context_.connection.address.empty()) call_.processor = machine_info().processor;
  for (int view = 0; references_.given() && view < request.views_size(); ++view) {
    const auto hash = hash_file(references_.file(view));
    if (!hash) {
      context_.reader.problem(options_.script.reference, hash.error().to_string());
      return false;
    }
    pb::CompareRecord::ReferenceFile& file = call_.reference_files.emplace_back();
    file.set_path(as_utf8(references_.file(view)));
    file.set_sha256(hash->sha256.data(), hash->sha256.size());
  }
  if (!grow_record()) return false;
  const std::uint64_t units = unit_count(record_.request()), most = info.limits().max_compare_units();
  if (most > 0 && units > most) {
    problems.add("--seeds", fmt::format("{} modes x {} seeds x {} budgets x {} views = {} pictures; allowed: {} "
                                        "(max-compare-units of the daemon)",
                                        record_.request().modes_size(), record_.request().seeds(),
                                        budgets_of(record_.request()).size(), request.views_size(), units, most));
  }
  const double pixels = double(record_.request().modes_size()) * record_.request().seeds() * request.views_size() *
                        size_.first * size_.second;
  if (const auto limit = info.limits().max_compare_pixels(); limit > 0 && pixels > double(limit)) {
    problems.add("--seeds", fmt::format("{} modes x {} seeds x {} views of {}x{} = {} pixels; allowed: {} "
                                        "(max-compare-pixels of the daemon)",
                                        record_.request().modes_size(), record_.request().seeds(), request.views_size(),
                                        size_.first, size_.second, number_text(pixels), limit));
  }
  return problems.empty();
}

bool Comparing::grow_record() {
  if (kept_) record_ = *kept_;
  const ComparisonDifferences found = compare_with_record(record_, call_);
  for (const std::string& difference : found.of_shape)
    context_.problems.add("--output", "the folder's comparison differs in " + difference);
  if (!options_.mix || !found.of_shape.empty()) {
    for (const std::string& difference : found.of_values)
      context_.problems.add("--output", "the folder's comparison differs in " + difference);
  }
  if (!found.of_shape.empty()) {
    context_.problems.add("--output", "another folder is needed: no table could hold both, with --mix neither");
  } else if (!found.of_values.empty() && !options_.mix) {
    context_.problems.add("--output", "another folder is needed, or --mix, which puts both into one table");
  }
  if (!context_.problems.empty()) return false;
  if (references_.given() && kept_ && kept_->request().reference().has_loaded()) {
    // By these ids the daemon may still know them.
    *call_.request.mutable_reference() = kept_->request().reference();
    for (int view = 0; view < kept_->reference_files_size() && view < int(call_.reference_files.size()); ++view) {
      if (kept_->reference_files(view).sha256() != call_.reference_files[std::size_t(view)].sha256())
        call_.request.mutable_reference()->mutable_loaded()->clear_reference_ids();
    }
  }
  extend_record(record_, call_, found.of_values);
  whole_ = kept_ && kept_->has_table() && !kept_->table().partial() &&
           std::uint64_t(record_.units_size()) == unit_count(record_.request()) &&
           google::protobuf::util::MessageDifferencer::Equals(kept_->request(), record_.request()) &&
           !ComparisonFolder(folder_, record_, control_).request().send_pictures();
  for (const std::string& difference : found.of_values) terminal_.warn("mixed: " + difference);
  return true;
}

Result<std::vector<std::string>> Comparing::upload_references(RenderClient& client,
                                                              const std::vector<std::string>& files) {
  std::vector<std::string> ids;
  for (std::size_t view = 0; view < files.size(); ++view) {
    const auto loaded = client.load_reference(
        files[view],
        [&](std::uint64_t sent, std::uint64_t total) {
          terminal_.progress(fmt::format("sending reference {} of {}: {:.0f} % of {}B", view + 1, files.size(),
                                         100.0 * double(sent) / double(total), human_count(double(total))));
        },
        &control_);
    if (!loaded) return loaded.error();
    ids.push_back(loaded->reference_id());
  }
  terminal_.end_progress();
  return ids;
}

// Uploads the rendered references that the daemon does not have any more, and answers their ids. Empty: they have to be
// rendered again.
Result<std::vector<std::string>> Comparing::upload_kept_references(RenderClient& client, ComparisonFolder& folder) {
  const std::vector<std::string> files = folder.rendered_reference_files();
  if (files.empty()) return files;
  const auto ids = upload_references(client, files);
  if (!ids) {
    if (control_.cancelled() || ids.error().code == ErrorCode::unavailable) return ids.error();
    terminal_.warn("the references in " + (folder_ / "pictures").string() +
                   " cannot be used again and are rendered again: " + ids.error().to_string());
    return std::vector<std::string>();
  }
  const std::string text = "the references in " + (folder_ / "pictures").string() +
                           " are used instead of rendering them again; their noise is taken off by their variance";
  folder.use_reference_files();
  folder.notice(text);
  terminal_.say("notice: " + text);
  return ids;
}

Result<pb::CompareResponse::Result> Comparing::compare(RenderClient& client, ComparisonFolder& folder) {
  pb::CompareRequest request = folder.request();
  const auto name_references = [&](const std::vector<std::string>& ids) {
    auto& loaded = *request.mutable_reference()->mutable_loaded();
    loaded.clear_reference_ids();
    for (const std::string& id : ids) loaded.add_reference_ids(id);
  };
  // Into the request. Those that were given go to the record, too.
  const auto upload = [&]() -> Status {
    std::vector<std::string> files;
    for (int view = 0; references_.given() && view < view_count(request); ++view)
      files.push_back(references_.file(view));
    const auto ids = references_.given() ? upload_references(client, files) : upload_kept_references(client, folder);
    if (!ids) return ids.error();
    if (references_.given()) folder.set_reference_ids(*ids);
    if (ids->empty()) {
      request.mutable_reference()->CopyFrom(folder.record().request().reference());
    } else {
      name_references(*ids);
    }
    return ok_status();
  };
  bool by_old_ids = true;
  if (references_.given()) {
    by_old_ids = !request.reference().loaded().reference_ids().empty();
    if (!by_old_ids) {
      if (const Status sent = upload(); !sent) return sent.error();
    }
  } else {
    const std::vector<std::string> ids = folder.rendered_reference_ids();
    by_old_ids =
        !ids.empty() && (request.send_pictures() || std::uint64_t(folder.record().units_size()) < unit_count(request));
    if (by_old_ids) name_references(ids);
  }
  CompareClock clock(folder.record());
  std::set<std::string> said;  // of notices: there may be a second call
  CompareCallbacks callbacks;
  callbacks.accepted = [&](const pb::CompareResponse::Accepted& accepted) {
    folder.accepted(accepted);
    for (const std::string& text : accepted.notices())
      if (said.insert(text).second) terminal_.say("notice: " + single_line(text));
    if (accepted.waits_for() > 0) {
      terminal_.progress(fmt::format("waiting for {} {}", accepted.waits_for(),
                                     accepted.waits_for() == 1 ? "comparison" : "comparisons"));
    }
  };
  callbacks.progress = [&](const pb::CompareResponse::Progress& progress) {
    clock.progress(now_s(), progress.seed_number() > 0);
    folder.progress();
    terminal_.progress(describe(progress, folder.record(), clock.seconds_left()));
  };
  callbacks.reference = [&](const pb::CompareResponse::Reference& reference) {
    folder.reference(reference);
    if (!references_.given() || reference.noise() != pb::CompareResponse::Reference::NOISE_UNSPECIFIED) return;
    const std::string text =
        "the reference has no channels variance.R, variance.G and variance.B: its own noise stays in mse and relmse";
    folder.notice(text);
    if (said.insert(text).second) terminal_.say("notice: " + text);
  };
  callbacks.unit = [&](const pb::CompareUnit& unit) {
    clock.unit(unit);
    folder.unit(unit);
  };
  callbacks.picture = [&](pb::CompareResponse::Picture picture) { folder.picture(std::move(picture)); };
  auto result = client.compare(request, callbacks, &control_);
  // The daemon may have let the references go, or be another one.
  if (!result && result.error().code == ErrorCode::not_found && by_old_ids) {
    if (const Status sent = upload(); !sent) return sent.error();
    result = client.compare(request, callbacks, &control_);
  }
  terminal_.end_progress();
  return result;
}

Status Comparing::write_report(const pb::CompareRecord& record, Json& json) {
  const std::string page = comparison_report(record, folder_);
  const std::string file = (folder_ / "report.html").string();
  const Status written = write_file_atomically(file, {reinterpret_cast<const std::uint8_t*>(page.data()), page.size()});
  if (written) json["report"] = file;
  return written;
}

int Comparing::finish(const Interrupt& interrupt, ComparisonFolder& folder,
                      const Result<pb::CompareResponse::Result>& result, Json json) {
  Status kept = result ? folder.finish(*result) : folder.interrupted(partial_table(folder.record()));
  const pb::CompareRecord& record = folder.record();
  if (record.has_table() && kept) kept = write_report(record, json);
  if (result) {
    json["seconds"] = result->seconds();
    json["rendering_seconds"] = result->rendering_seconds();
  }
  add_comparison(json, record);
  for (const std::string& text : record.notices()) json["notices"].push_back(text);
  json["partial"] = !result;
  std::string in_folder = fmt::format("; {} of {} pictures are measured in {}, and the same command goes on",
                                      record.units_size(), unit_count(record.request()), folder_.string());
  if (record.units().empty()) in_folder = "; no picture is measured yet";
  if (folder.failure()) {
    return terminal_.fail(exit_code_of(*folder.failure()), folder.failure()->to_string() + in_folder, json);
  }
  if (!kept) return terminal_.fail(kFailed, kept.error().to_string(), json);
  if (!result && record.has_table()) terminal_.say((folder_ / "report.html").string() + " (partial)");
  if (!result && interrupt.raised()) return terminal_.fail(interrupt.exit_code(), "interrupted" + in_folder, json);
  if (!result) return terminal_.fail(exit_code_of(result.error()), result.error().to_string() + in_folder, json);
  for (const std::string& line : describe_table(record)) terminal_.say(line);
  terminal_.say((folder_ / "report.html").string());
  terminal_.result(json);
  return kOk;
}

int Comparing::render(const Interrupt& interrupt) {
  Result<Renderer> renderer = Renderer::open(context_.connection);
  if (!renderer) return context_.fail(renderer.error());
  RenderClient& client = renderer->client();
  const auto info = client.server_info();
  if (!info) return context_.fail(info.error());
  if (!check_server(*info)) return context_.refuse();
  const LoadOutcome outcome = load_scene(client, scene_, terminal_, &control_);
  if (interrupt.raised())
    return terminal_.fail(interrupt.exit_code(), "interrupted while loading; nothing was rendered yet");
  if (outcome.failure) return terminal_.fail(outcome.failure->exit_code, outcome.failure->error.to_string());
  if (!plan(*info, outcome.scene->response)) return context_.refuse();

  Json json;
  json["load_seconds"] = outcome.scene->seconds;
  json["seconds"] = 0.0;
  json["rendering_seconds"] = 0.0;
  json["output"] = folder_.string();
  json["report"] = nullptr;
  json["scene_id"] = call_.request.scene_id();
  json["width"] = size_.first;
  json["height"] = size_.second;
  add_load_report(json, outcome.scene->response);
  if (whole_) {
    terminal_.say("notice: the folder has all of this comparison already; nothing is rendered");
    const Status written = write_report(*kept_, json);
    if (!written) return terminal_.fail(kFailed, written.error().to_string(), json);
    add_comparison(json, *kept_);
    json["units_rendered"] = 0;
    json["partial"] = false;
    for (const std::string& line : describe_table(*kept_)) terminal_.say(line);
    terminal_.say((folder_ / "report.html").string());
    terminal_.result(json);
    return kOk;
  }
  if (!lock_) {
    if (!lock_folder()) return context_.refuse();
    if (fs::exists(folder_ / "comparison.json")) {
      context_.problems.add("--output",
                            "the folder '" + folder_.string() +
                                "' got a comparison since this command began; the same command goes on with it");
      return context_.refuse();
    }
  }
  if (!record_.units().empty()) {
    terminal_.say(fmt::format("notice: going on with {}: {} of {} pictures of all that was asked for are there",
                              folder_.string(), record_.units_size(), unit_count(record_.request())));
  }
  ComparisonFolder folder(folder_, record_, control_);
  return finish(interrupt, folder, compare(client, folder), std::move(json));
}

int Comparing::run() {
  if (!read_flags()) return context_.refuse();
  const Interrupt interrupt([&] { control_.cancel(); });
  return render(interrupt);
}

Command add_compare(CLI::App& root, const PresetPart* part);

// All flags are read before the first comparison.
int compare_preset(const CLI::App& app, const CompareOptions& options) {
  CommandContext context(app, options.common);
  pb::CompareRequest checked;
  read_compare_script(options.script, options.modes.common.seed, false, context.reader, checked);
  context.reader.size(options.modes.common.size);
  const fs::path folder = read_folder(options.output, context.reader);
  const auto run = [&](const std::vector<std::string>& words) {
    std::vector<std::string> line{"heliograph", "compare"};
    line.insert(line.end(), words.begin(), words.end());
    const PresetPart part{command_line(line), options.common.json};
    std::vector<std::string> all = words;
    if (part.json) all.emplace_back("--json");
    return run_words([&](CLI::App& own) { return add_compare(own, &part); }, all);
  };
  return run_preset(options.preset, given_options(app), folder, context, run);
}

Command add_compare(CLI::App& root, const PresetPart* part) {
  CLI::App* app = add_command(root, "compare", "Compare sampling modes by error against time and samples, over seeds",
                              std::string(kHelp) + kCompareModesHelp + kFolderHelp + kCompareJsonHelp + kPresetHelp +
                                  kPresetJsonHelp + kEndHelp + kExitCodesHelp);
  auto options = std::make_shared<CompareOptions>();
  add_scene_options(*app, options->scene);
  add_compare_mode_options(*app, options->modes);
  add_path_option(
      *app, options->path,
      "Compare along a camera path, by name or from a file, as of move; it starts at --camera. Default: a still");
  add_compare_script_options(*app, options->script);
  add_text(*app, options->oidn_library, "--oidn-library", "PATH",
           "libOpenImageDenoise.so of Open Image Denoise 2.x for modes oidn; only without --server. Default: "
           "HELIOGRAPH_OIDN of the environment");
  add_text(*app, options->output, "--output,-o", "FOLDER",
           "Where the comparison is kept, and goes on; made where it does not exist. Required");
  add_flag(*app, options->mix, "--mix",
           "Go on with the folder's comparison although scene, settings, build or threads differ");
  add_preset_options(*app, options->preset);
  add_common_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options, part] {
            if (!part && options->preset.name.given()) return compare_preset(*app, *options);
            return Comparing(*app, *options, part).run();
          }};
}

}  // namespace

Command add_compare(CLI::App& root) {
  return add_compare(root, nullptr);
}

}  // namespace helio::cli
