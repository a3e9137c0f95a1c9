// heliograph techniques: the weighted contribution of each bidirectional technique.
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>

#include "client/cli/command.h"
#include "client/cli/commands/contact_sheet.h"
#include "client/cli/commands/open_scene.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/picture_files.h"
#include "client/cli/commands/render_report.h"
#include "client/cli/exit_code.h"
#include "client/frame_assembler.h"
#include "renderer/base/clock.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr std::uint64_t kMostSegments = 16;  // 151 pictures
constexpr int kDefaultSegments = 5;

struct TechniquesOptions {
  SceneOptions scene;
  SettingsOptions settings;
  BudgetOptions budget;
  TextOption max_length, output;
  CommonOptions common;
};

constexpr const char* kHelp =
    "A path of s light and t camera vertices, the points on light and camera counted, has s + t - 1 segments:\n"
    "  s = 0         a camera path meets a light, or leaves for the environment\n"
    "  s = 1         a light sample at the camera path's last vertex\n"
    "  s > 1, t > 1  a vertex of a light path is joined to one of a camera path\n"
    "  t = 1         a vertex of a light path is joined to the camera\n"
    "FOLDER gets, for each, sSS-tTT.exr: its share of --integrator bdpt, by its weight among all (all of them add up "
    "to\n"
    "that picture with the same --seed); and weighted.png: all of them, one row for each number of segments, s from 0 "
    "on\n"
    "to the right, named s,t, each row exposed for its sum.\n"
    "The table, and with --json the object, gives the mean luminance of each, its share of the sum, and the time of "
    "its\n"
    "render: load_seconds, seconds, width, height, samples, max_length, techniques: [{light_vertices, "
    "camera_vertices,\n"
    "segments, mean, share (null: all black), render_seconds, invalid_samples, output}], mean (of the sum),\n"
    "weighted_png, exposure_stops (of each row), partial, warnings, notices, unread. Ctrl-C keeps the pictures so "
    "far.\n"
    "Example: heliograph techniques room.glb --size 320x180 --samples 64 --max-length 4 --output room-techniques\n\n";

// Result of rendering one technique.
struct Shown {
  pb::Technique technique;
  double mean = 0;
  double seconds = 0;
  std::uint64_t invalid_samples = 0;
  std::string file;
};

std::vector<pb::Technique> techniques_up_to(int max_segments) {
  std::vector<pb::Technique> all;
  for (int segments = 1; segments <= max_segments; ++segments) {
    for (int s = 0; s <= segments; ++s) {
      if (s == 1 && segments == 1) continue;  // lights seen directly come from s = 0 alone
      pb::Technique technique;
      technique.set_light_vertices(s);
      technique.set_camera_vertices(segments + 1 - s);
      all.push_back(technique);
    }
  }
  return all;
}

int segments_of(const pb::Technique& technique) {
  return technique.light_vertices() + technique.camera_vertices() - 1;
}

std::string file_of(const std::string& folder, const pb::Technique& technique) {
  const std::string name = fmt::format("s{:02}-t{:02}.exr", technique.light_vertices(), technique.camera_vertices());
  return (std::filesystem::path(folder) / name).string();
}

std::string sheet_of(const std::string& folder) {
  return (std::filesystem::path(folder) / "weighted.png").string();
}

// A folder that exists, or can be made inside one that does.
std::string read_folder(const TextOption& option, const std::string& fallback, OptionReader& reader) {
  std::filesystem::path folder(option.given() ? reader.text(option).value_or("") : fallback);
  if (!folder.has_filename()) folder = folder.parent_path();  // a slash at the end
  std::error_code ignored;
  if (folder.empty() || std::filesystem::is_directory(folder, ignored)) return folder.string();
  const std::filesystem::path parent = folder.has_parent_path() ? folder.parent_path() : std::filesystem::path(".");
  if (std::filesystem::exists(folder, ignored)) {
    reader.problem(option, "'" + folder.string() + "' is a file; allowed: a folder, or a new one's name");
  } else if (!std::filesystem::is_directory(parent, ignored)) {
    reader.problem(option, "the folder '" + parent.string() + "' does not exist");
  }
  return folder.string();
}

double mean_luminance(const PictureView& view) {
  double sum = 0;
  for (std::size_t p = 0; p < view.pixels(); ++p)
    sum += luminance(Rgb(view.channels[0][p], view.channels[1][p], view.channels[2][p]));
  return sum / double(view.pixels());
}

// The jobs, one after the other.
class TechniqueRenders {
 public:
  TechniqueRenders(RenderClient& client, const pb::RunJobRequest& request, Terminal& terminal, CallControl& control)
      : client_(client), request_(request), terminal_(terminal), control_(control) {}

  // Renders a technique, writes its picture and adds it to the sheet, which is made by the first.
  Status render(const pb::Technique& technique, const std::string& file, std::optional<ContactSheet>& sheet,
                Shown& shown) {
    const std::string name = fmt::format("s {}, t {}", technique.light_vertices(), technique.camera_vertices());
    *request_.mutable_settings()->mutable_technique() = technique;
    FrameAssembler frame;
    std::optional<Error> broken;
    const auto note = [&](const Error& error) {
      if (!broken) broken = error;
      control_.cancel();  // nothing that follows can be trusted
    };
    JobCallbacks callbacks;
    callbacks.accepted = [&](const pb::RunJobResponse::Accepted& accepted) {
      const Status begun = frame.begin(accepted.settings());
      if (!begun) note(begun.error());
    };
    callbacks.progress = [&](const pb::Progress& progress) { terminal_.progress(name + ": " + describe(progress)); };
    callbacks.tile = [&](pb::Tile tile) {
      const auto added = frame.add(std::move(tile));
      if (!added) note(added.error());
    };
    const auto end = client_.run_job(request_, callbacks, &control_);
    terminal_.end_progress();
    if (broken) return *broken;
    if (!end) return end.error();
    if (end->reason() == pb::END_REASON_FAILED) return Error{ErrorCode::internal, name + ": " + end->message(), {}};
    if (end->reason() == pb::END_REASON_CANCELLED || !frame.final())
      return Error{ErrorCode::unavailable, "the server ended " + name + " early", {}};
    const auto picture = frame.picture();
    if (!picture) return picture.error();
    return keep(technique, **picture, *end, file, sheet, shown);
  }

 private:
  Status keep(const pb::Technique& technique, const Picture& picture, const pb::FrameEnd& end, const std::string& file,
              std::optional<ContactSheet>& sheet, Shown& shown) {
    const std::vector<float>* const radiance[] = {picture.find("R"), picture.find("G"), picture.find("B")};
    if (!radiance[0] || !radiance[1] || !radiance[2]) return Error{ErrorCode::internal, "tiles without R, G, B", {}};
    const PictureView view{picture.window.width(),
                           picture.window.height(),
                           {radiance[0]->data(), radiance[1]->data(), radiance[2]->data()}};
    if (!sheet) sheet.emplace(view.width, view.height);
    sheet->add(segments_of(technique) - 1,
               fmt::format("{},{}", technique.light_vertices(), technique.camera_vertices()), view);
    Json ended;
    add_frame_end(ended, end);
    shown.seconds = ended["render_seconds"].get<double>();
    shown.invalid_samples = ended["invalid_samples"].get<std::uint64_t>();
    shown.mean = mean_luminance(view);
    shown.file = file;
    if (const std::string warning = invalid_caution(technique, shown); !warning.empty()) terminal_.warn(warning);
    FileNames names;
    names.exr = file;
    Json ignored;
    return write_files(names, picture, {}, ignored);
  }

  static std::string invalid_caution(const pb::Technique& technique, const Shown& shown) {
    if (shown.invalid_samples == 0) return {};
    return fmt::format("s {}, t {}: {} samples were NaN or infinite and are left out", technique.light_vertices(),
                       technique.camera_vertices(), shown.invalid_samples);
  }

  RenderClient& client_;
  pb::RunJobRequest request_;
  Terminal& terminal_;
  CallControl& control_;
};

std::string share_text(double mean, double sum) {
  return sum > 0 ? fmt::format("{:.2f} %", 100 * mean / sum) : "-";
}

void tell(Terminal& terminal, const std::vector<Shown>& all, double sum) {
  terminal.say(fmt::format("{:>3} {:>3} {:>12} {:>9} {:>9}", "s", "t", "mean", "share", "seconds"));
  double seconds = 0;
  for (const Shown& shown : all) {
    terminal.say(fmt::format("{:>3} {:>3} {:>12.6g} {:>9} {:>9.3f}", shown.technique.light_vertices(),
                             shown.technique.camera_vertices(), shown.mean, share_text(shown.mean, sum),
                             shown.seconds));
    seconds += shown.seconds;
  }
  terminal.say(fmt::format("{:>7} {:>12.6g} {:>9} {:>9.3f}", "all", sum, share_text(sum, sum), seconds));
}

Json to_json(const std::vector<Shown>& all, double sum) {
  Json list = Json::array();
  for (const Shown& shown : all) {
    Json json;
    json["light_vertices"] = shown.technique.light_vertices();
    json["camera_vertices"] = shown.technique.camera_vertices();
    json["segments"] = segments_of(shown.technique);
    json["mean"] = shown.mean;
    json["share"] = sum > 0 ? Json(shown.mean / sum) : Json(nullptr);
    json["render_seconds"] = shown.seconds;
    json["invalid_samples"] = shown.invalid_samples;
    json["output"] = shown.file;
    list.push_back(json);
  }
  return list;
}

// Renders all; `all` holds those whose picture is written.
Status render_all(TechniqueRenders& renders, const std::string& folder, int max_segments, Json& json,
                  std::vector<Shown>& all) {
  std::optional<ContactSheet> sheet;
  for (const pb::Technique& technique : techniques_up_to(max_segments)) {
    Shown shown;
    shown.technique = technique;
    const Status done = renders.render(technique, file_of(folder, technique), sheet, shown);
    if (!done) return done;
    all.push_back(shown);
  }
  const std::vector<double> exposures = sheet->exposures();
  const Status written = sheet->write(sheet_of(folder), exposures);
  if (!written) return written;
  json["weighted_png"] = sheet_of(folder);
  for (const double exposure : exposures) json["exposure_stops"].push_back(std::log2(exposure));
  return ok_status();
}

// Nothing that is read may be overwritten.
void check_outputs(const SceneChoice& choice, const std::string& folder, int max_segments, Problems& problems) {
  OutputCheck outputs;
  outputs.add_inputs(choice);
  for (const pb::Technique& technique : techniques_up_to(max_segments))
    outputs.check("--output", file_of(folder, technique), problems);
  outputs.check("--output", sheet_of(folder), problems);
}

int run(const CLI::App& app, const TechniquesOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  pb::RunJobRequest request;
  *request.mutable_settings() = read_settings(options.settings, reader);
  context.connection.vulkan_devices = asks_for_device(request.settings());
  *request.mutable_budget() = read_budget(options.budget, reader);
  *request.mutable_format() = read_transport({}, context.connection.address, reader);
  request.mutable_settings()->set_integrator(pb::INTEGRATOR_BDPT);
  const int longest = int(reader.integer(options.max_length, 1, kMostSegments).value_or(kDefaultSegments));
  request.mutable_settings()->set_max_segments(longest);
  const std::string folder = read_folder(options.output, scene_stem(choice) + "-techniques", reader);
  check_outputs(choice, folder, longest, problems);
  if (!problems.empty()) return context.refuse();

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  auto opened = open_scene(context, options.settings, choice, control, interrupt, *request.mutable_settings());
  if (const int* exit_code = std::get_if<int>(&opened)) return *exit_code;
  auto& open = std::get<OpenScene>(opened);
  *request.mutable_camera() = open.camera.view();
  request.set_scene_id(open.scene().scene_id());
  std::error_code unmade;
  std::filesystem::create_directory(folder, unmade);
  if (unmade) return terminal.fail(kFailed, "the folder '" + folder + "' cannot be made: " + unmade.message());

  Json json;
  json["load_seconds"] = open.loaded.seconds;
  json["seconds"] = 0.0;
  json["width"] = request.settings().width();
  json["height"] = request.settings().height();
  json["samples"] = request.budget().samples();
  json["max_length"] = longest;
  const double begun = now_s();
  std::vector<Shown> all;
  TechniqueRenders renders(open.renderer.client(), request, terminal, control);
  const Status done = render_all(renders, folder, longest, json, all);
  json["seconds"] = now_s() - begun;
  double sum = 0;
  for (const Shown& shown : all) sum += shown.mean;
  json["mean"] = sum;
  json["techniques"] = to_json(all, sum);
  json["partial"] = !done;
  add_load_report(json, open.loaded.response);
  const std::string kept =
      fmt::format("; {} of {} techniques are in {}", all.size(), techniques_up_to(longest).size(), folder);
  if (interrupt.raised() && !done) return terminal.fail(interrupt.exit_code(), "interrupted" + kept, json);
  if (!done) return terminal.fail(exit_code_of(done.error()), done.error().to_string() + kept, json);
  tell(terminal, all, sum);
  terminal.say(sheet_of(folder));
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_techniques(CLI::App& root) {
  CLI::App* app =
      add_command(root, "techniques", "Render the weighted contribution of each bidirectional technique (s, t)",
                  std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<TechniquesOptions>();
  add_scene_options(*app, options->scene);
  add_picture_options(*app, options->settings);
  add_text(*app, options->budget.fields["samples"], "--samples", "N",
           "Samples per pixel of each picture, [1, 2^30]. Default: 64");
  add_text(*app, options->max_length, "--max-length", "K",
           "Longest path, in segments with the camera's counted, [1, 16]. Default: 5, which is 19 pictures");
  add_text(*app, options->output, "--output,-o", "FOLDER",
           "Where the pictures go; made where it does not exist. Default: NAME-techniques in the current folder for "
           "scene NAME.glb");
  add_common_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
