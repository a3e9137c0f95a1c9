// heliograph submit: a job that a daemon keeps.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <variant>

#include "client/cli/command.h"
#include "client/cli/commands/open_scene.h"
#include "client/cli/commands/path_option.h"
#include "client/cli/exit_code.h"
#include "client/cli/jobs/follow_job.h"
#include "client/cli/jobs/job_report.h"
#include "client/cli/shard_option.h"
#include "client/jobs/job_client.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr std::size_t kMostViews = 10000;
constexpr std::size_t kMostName = 256, kMostToken = 128, kMostPath = 4096;

struct SubmitOptions {
  SceneOptions scene;
  SettingsOptions settings;
  BudgetOptions budget;
  TransportOptions file;
  TextOption path, steps, step, pivot, shard, name, priority, output, client_token;
  bool overwrite = false, require_same_bits = false, watch = false;
  CommonOptions common;
};

constexpr const char* kHelp =
    "The daemon answers as soon as the job is on its disk. The job then needs neither this command nor this machine,\n"
    "and goes on after a restart of the daemon (heliographd --state), from its newest checkpoint. heliograph job ID\n"
    "shows, watches and fetches it; heliograph jobs lists all.\n"
    "The scene is sent as heliograph render does, and the daemon keeps it for the job.\n"
    "With --json, stdout holds one object: job_id, already_there (of an earlier submission with the --client-token),\n"
    "and what heliograph job --json has, with --watch at its end; load_seconds, notices, unsampled, warnings, unread.\n"
    "Example: heliograph submit room.glb --size 3840x2160 --error 0.002 --name room --server 10.0.0.5:50051\n"
    "Example: heliograph submit room.glb --samples 4096 --output-on-server rooms/one.exr\n\n";

void check_text(const TextOption& option, const std::string& text, std::size_t most, OptionReader& reader) {
  const bool control = std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; });
  if (text.size() <= most && !control) return;
  reader.problem(option, fmt::format("has {} bytes{}; allowed: at most {}, without control characters", text.size(),
                                     control ? ", control characters among them" : "", most));
}

// What does not depend on the scene.
pb::SubmitJobRequest read_request(const SubmitOptions& options, OptionReader& reader) {
  pb::SubmitJobRequest request;
  pb::RunJobRequest& job = *request.mutable_job();
  *job.mutable_settings() = read_settings(options.settings, reader);
  *job.mutable_budget() = read_budget(options.budget, reader);
  *job.mutable_format() = read_kept_file(options.file, reader);
  request.set_name(reader.text(options.name).value_or(""));
  check_text(options.name, request.name(), kMostName, reader);
  request.set_client_token(reader.text(options.client_token).value_or(""));
  check_text(options.client_token, request.client_token(), kMostToken, reader);
  request.set_priority(reader.signed_integer(options.priority, -100, 100).value_or(0));
  request.set_require_same_bits(options.require_same_bits);
  if (const auto path = reader.text(options.output)) {
    check_text(options.output, *path, kMostPath, reader);
    if (!path->ends_with(".exr")) reader.problem(options.output, "'" + *path + "' does not end in .exr");
    request.mutable_output()->set_path(*path);
    request.mutable_output()->set_overwrite(options.overwrite);
  } else if (options.overwrite && !options.output.given()) {
    reader.problems().add("--overwrite", "is only valid with --output-on-server");
  }
  return request;
}

// The path's text and scale, and the centre of its orbits where that is not the scene's.
struct PathChoice {
  std::string text;
  PathScale scale;
  std::optional<V3d> pivot;
};

PathChoice read_path(const SubmitOptions& options, OptionReader& reader) {
  PathChoice path{read_path_file(options.path, reader),
                  read_path_scale(options.path, options.steps, options.step, reader), reader.vector(options.pivot)};
  if (options.steps.given() && !is_path_by_name(options.path))
    reader.problem(options.steps, "is only valid with a --path by name");
  if (options.pivot.given() && !options.path.given()) reader.problem(options.pivot, "is only valid with --path");
  return path;
}

// The still's camera, or the views of the path.
void set_views(const SubmitOptions& options, const PathChoice& path, const OpenScene& open, pb::RunJobRequest& job,
               OptionReader& reader) {
  if (!options.path.given()) {
    *job.mutable_camera() = open.camera.view();
    return;
  }
  const V3d pivot = path.pivot.value_or(centre_of(open.scene()));
  const PathStart start{open.camera.view(), pivot, cameras_of(open.scene())};
  const auto views = read_path_views(options.path, path.text, path.scale, start);
  if (!views) return reader.problem(options.path, views.error().to_string());
  if (views->size() > kMostViews)
    return reader.problem(options.path, fmt::format("{} views; allowed: at most {}", views->size(), kMostViews));
  for (std::size_t i = 0; i < views->size(); ++i) {
    if ((*views)[i].budget) {
      return reader.problem(options.path,
                            fmt::format("view {} has a budget of its own; those of a job have one, which is "
                                        "--samples, --time or --error",
                                        i));
    }
    *job.add_views() = (*views)[i].camera;
  }
}

// Before the scene is sent. The answer says why the daemon keeps none.
Status check_keeps_jobs(RenderClient& client) {
  pb::ListJobsRequest one;
  one.set_page_size(1);
  const auto listed = JobClient(client).list(one);
  if (!listed) return listed.error();
  return ok_status();
}

Json report(const pb::SubmitJobResponse& submitted, const OpenScene& open) {
  Json json;
  json["job_id"] = submitted.job().job_id();
  json["already_there"] = submitted.already_there();
  json.update(to_json(submitted.job()));
  json["load_seconds"] = open.loaded.seconds;
  json["unsampled"] = Json::array();
  for (const std::string& text : submitted.unsampled()) json["unsampled"].push_back(text);
  add_load_report(json, open.loaded.response);
  for (const std::string& text : submitted.notices()) json["notices"].push_back(text);
  json["notices_total"] = json["notices_total"].get<std::size_t>() + std::size_t(submitted.notices_size());
  return json;
}

int run(const CLI::App& app, const SubmitOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  const PathChoice path = read_path(options, reader);
  pb::SubmitJobRequest request = read_request(options, reader);
  pb::RunJobRequest& job = *request.mutable_job();
  const auto shard = read_shard(options.shard, options.settings, job.settings(), job.budget(), job.format(), reader);
  if (!context.problems.empty()) return context.refuse();

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  auto opened =
      open_scene(context, options.settings, choice, control, interrupt, *job.mutable_settings(), check_keeps_jobs);
  if (const int* exit_code = std::get_if<int>(&opened)) return *exit_code;
  auto& open = std::get<OpenScene>(opened);
  set_region(shard, options.shard, *job.mutable_settings(), reader);
  set_views(options, path, open, job, reader);
  if (!context.problems.empty()) return context.refuse();
  job.set_scene_id(open.scene().scene_id());
  if (request.name().empty()) request.set_name(scene_stem(choice) + (shard ? " " + to_string(*shard) : ""));

  JobClient jobs(open.renderer.client());
  const auto submitted = jobs.submit(request, &control);
  if (interrupt.raised() && !submitted) {
    return terminal.fail(interrupt.exit_code(),
                         "interrupted; the job may have been submitted all the same: heliograph jobs lists it");
  }
  if (!submitted) return context.fail(submitted.error());
  const pb::Job& kept = submitted->job();
  for (const std::string& text : submitted->unsampled()) terminal.say("notice: " + single_line(text));
  for (const std::string& text : submitted->notices()) terminal.say("notice: " + single_line(text));
  terminal.say(fmt::format("job {}: {}{}", kept.job_id(), state_name(kept.state()),
                           submitted->already_there() ? " (submitted before)" : ""));
  const std::string& server = context.connection.flags;
  if (!options.watch) terminal.say("  to follow it:       heliograph job " + kept.job_id() + " --watch" + server);
  if (!kept.has_output())
    terminal.say("  to get its picture: heliograph job " + kept.job_id() + " --fetch FILE.exr" + server);
  Json json = report(*submitted, open);
  if (options.watch) {
    const auto ended = follow_to_end(jobs, kept.job_id(), context, interrupt, control, json);
    if (const int* exit_code = std::get_if<int>(&ended)) return *exit_code;
    json.update(to_json(std::get<pb::Job>(ended)));
  }
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_submit(CLI::App& root) {
  CLI::App* app =
      add_command(root, "submit", "Give a daemon a job that outlives this command and the daemon's restarts",
                  std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<SubmitOptions>();
  add_scene_options(*app, options->scene);
  add_path_option(*app, options->path,
                  "Render a camera path, one picture a view: by name or from a file, as of heliograph move. Default: a "
                  "still");
  add_text(*app, options->steps, "--steps", "N", "Steps of a path by name, [1, 100000]. Default: its own");
  add_text(*app, options->step, "--step", "X",
           "Size of a step of a path by name, as of heliograph move. Default: its own");
  add_text(*app, options->pivot, "--pivot", "x,y,z",
           "Centre of the path's orbits, and what paths by name measure distance to. Default: centre of the scene's "
           "bounds");
  add_settings_options(*app, options->settings);
  add_budget_options(*app, options->budget, "each view", false);
  add_kept_file_options(*app, options->file);
  add_shard_option(*app, options->shard);
  add_text(*app, options->name, "--name", "TEXT",
           "Name for people, at most 256 bytes. Default: NAME for scene NAME.glb");
  add_text(*app, options->priority, "--priority", "N", "Higher goes first, [-100, 100]. Default: 0");
  add_text(*app, options->output, "--output-on-server", "PATH.exr",
           "File on the daemon's machine: inside one of its --output-root folders, or relative to the first. {view} "
           "becomes the number of the view. Default: the daemon keeps the picture, for heliograph job ID --fetch");
  add_flag(*app, options->overwrite, "--overwrite",
           "Replace the --output-on-server file that is there. Default: the job is refused");
  add_text(*app, options->client_token, "--client-token", "TEXT",
           "A second submission with the same text, at most 128 bytes, answers the job of the first. Default: none");
  add_flag(*app, options->require_same_bits, "--require-same-bits",
           "Pause the job, rather than go on with other bits, after a restart with another build or instruction path");
  add_flag(*app, options->watch, "--watch",
           "Follow the job until it has ended; Ctrl-C ends the command alone. With --wait a daemon that restarts is "
           "waited for. A job that failed or was canceled is exit code 1");
  add_common_daemon_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
