// heliograph render: one still, to a budget.
#include <spdlog/fmt/fmt.h>

#include <memory>
#include <mutex>
#include <optional>

#include "client/cli/command.h"
#include "client/cli/commands/open_scene.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/picture_files.h"
#include "client/cli/commands/render_report.h"
#include "client/cli/denoiser_options.h"
#include "client/cli/exit_code.h"
#include "client/cli/shard_option.h"
#include "client/cli/tev_option.h"
#include "client/frame_assembler.h"
#include "client/shards/picture_origin.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct RenderOptions {
  SceneOptions scene;
  SettingsOptions settings;
  BudgetOptions budget;
  FileOptions files;
  TransportOptions transport;
  DenoiserOptions denoiser;
  TextOption tev, shard;
  CommonOptions common;
};

constexpr const char* kHelp =
    "With --json, stdout holds one object: samples (per pixel), load_seconds (reading, sending, decoding, building),\n"
    "render_seconds, rays, rays_per_path, estimated_rmse (standard error of the picture, radiance units),\n"
    "estimated_relmse (both null while unknown), invalid_samples (NaN or infinite, left out), ended_by (samples, "
    "time,\n"
    "error, cancelled), width, height, samples_per_second, paths, worst_tile_rmse, all_black, unproven (share of the\n"
    "pixels that saw no light where surfaces reflect), hidden_rmse (bound on what they may add), output, png, heatmap\n"
    "(and density_map, reuse_map, each with its ..._range), reuse_share (of the samples, from earlier pictures),\n"
    "bias and bias_error (of the mean luminance, by merging light paths), verification_rays, pass_seconds (processor "
    "time of each pass),\n"
    "media_overflows (times that a volume within eight others was entered, whose absorption is left out),\n"
    "unsampled (light that the integrator leaves out of a picture of this scene; also the comments of the EXR),\n"
    "partial, warnings, notices, unread (lists may be cut: warnings_total, ... count all), animation, camera, "
    "scene_id,\n"
    "triangles, decode_seconds, build_seconds,\n"
    "first_tile_seconds, with --tev tev: {address, image, updates, warning}, and where samples were invalid,\n"
    "first_invalid and replay_token (see heliograph replay); on failure also error and exit_code. rays and paths\n"
    "count whole blocks of 16x16 pixels, also where a region ends inside one.\n"
    "The progress line shows the share of the budget used, samples per pixel, samples per second and the standard\n"
    "error so far. Ctrl-C ends the render and keeps what was rendered; a second Ctrl-C ends at once.\n"
    "The EXR's attribute heliograph.render says as JSON how the picture was made: scene_id, settings, budget, build.\n"
    "Example: heliograph render room.glb --size 640x360 --error 0.01 --png room.png\n\n";

// The job as the interrupt thread sees it: cancelled by its id once that is known, by its call before.
class CancellableJob {
 public:
  explicit CancellableJob(CallControl& control) : control_(control) {}

  void accepted(RenderClient& client, const std::string& id) {
    std::lock_guard lock(mutex_);
    client_ = &client;
    id_ = id;
  }
  void over() {
    std::lock_guard lock(mutex_);
    client_ = nullptr;
  }
  void cancel() {
    std::lock_guard lock(mutex_);
    // The result of a job that is cancelled by id tells what it rendered.
    if (client_ && client_->cancel_job(id_).ok()) return;
    control_.cancel();
  }

 private:
  std::mutex mutex_;
  CallControl& control_;
  RenderClient* client_ = nullptr;
  std::string id_;
};

// What came of the job, whether it ended well or not.
struct Outcome {
  Result<pb::FrameEnd> end = Error{};
  FrameAssembler picture;
  Unsampled unsampled;
  std::vector<std::string> notices;  // of the picture
  std::optional<pb::Progress> progress;
  std::optional<Error> broken_tile;
  pb::PictureOrigin origin;
};

// `tev`: with the scene's name; null: none.
struct Viewer {
  TevBridge* tev;
  std::string scene;
};

void run_job(RenderClient& client, const pb::RunJobRequest& request, const Viewer& viewer, Terminal& terminal,
             CallControl& control, CancellableJob& job, Outcome& outcome) {
  const auto note = [&](const Error& error) {
    if (!outcome.broken_tile) outcome.broken_tile = error;
    control.cancel();  // nothing that follows can be trusted
  };
  JobCallbacks callbacks;
  callbacks.accepted = [&](const pb::RunJobResponse::Accepted& accepted) {
    job.accepted(client, accepted.job_id());
    *outcome.origin.mutable_settings() = accepted.settings();
    const Status begun = outcome.picture.begin(accepted.settings());
    if (!begun) note(begun.error());
    if (viewer.tev) {
      viewer.tev->set_name(viewer.scene, accepted.job_id());
      if (const Status shown = viewer.tev->begin(accepted.settings()); !shown) note(shown.error());
    }
    outcome.unsampled.assign(accepted.unsampled().begin(), accepted.unsampled().end());
    outcome.notices.assign(accepted.notices().begin(), accepted.notices().end());
    for (const std::string& text : outcome.unsampled) terminal.say("notice: " + single_line(text));
    for (const std::string& text : outcome.notices) terminal.say("notice: " + single_line(text));
  };
  callbacks.progress = [&](const pb::Progress& progress) {
    outcome.progress = progress;
    terminal.progress(describe(progress));
  };
  callbacks.tile = [&](pb::Tile tile) {
    const auto added = add_and_show(outcome.picture, std::move(tile), viewer.tev);
    if (!added) note(added.error());
  };
  outcome.end = client.run_job(request, callbacks, &control);
  job.over();
  terminal.end_progress();
}

// Writes the files when every pixel has something to show. The text says what is kept, for a message.
Result<std::string> keep_picture(Outcome& outcome, const FileNames& names, Json& json) {
  if (!outcome.picture.complete()) return std::string("nothing was rendered yet");
  const auto picture = outcome.picture.picture();
  if (!picture) return picture.error();
  outcome.origin.set_samples_per_pixel(outcome.picture.samples_per_pixel());
  outcome.origin.set_ended_by(outcome.end && outcome.picture.final() ? outcome.end->reason()
                                                                     : pb::END_REASON_UNSPECIFIED);
  const Status written = write_files(names, **picture, outcome.unsampled, json, write_origin(outcome.origin));
  if (!written) return written.error();
  // The tiles tell what the file holds; reports may be ahead of them.
  json["samples"] = outcome.picture.samples_per_pixel();
  return fmt::format("the picture so far, {} samples, is in {}", outcome.picture.samples_per_pixel(), names.exr);
}

// The fields of a picture's origin that are known before its first sample.
pb::PictureOrigin origin_of(const pb::RunJobRequest& request, const pb::GetServerInfoResponse& server) {
  pb::PictureOrigin origin;
  origin.set_scene_id(request.scene_id());
  *origin.mutable_camera() = request.camera();
  *origin.mutable_settings() = request.settings();
  *origin.mutable_budget() = request.budget();
  origin.mutable_budget()->clear_bytes_per_second();
  origin.set_build(server.build());
  origin.set_isa(server.isa());
  return origin;
}

int finish(Terminal& terminal, const Interrupt& interrupt, Outcome& outcome, const FileNames& names, Json json) {
  if (outcome.progress) add_progress(json, *outcome.progress);
  if (outcome.end) add_frame_end(json, *outcome.end);
  const bool failed = outcome.end && outcome.end->reason() == pb::END_REASON_FAILED;
  const bool whole = outcome.end && !failed && outcome.end->reason() != pb::END_REASON_CANCELLED &&
                     !outcome.broken_tile && outcome.picture.final();
  json["partial"] = !whole;
  const Result<std::string> kept = keep_picture(outcome, names, json);
  const std::string kept_text = kept ? *kept : "the picture could not be written: " + kept.error().to_string();

  if (interrupt.raised() && !whole) return terminal.fail(interrupt.exit_code(), "interrupted; " + kept_text, json);
  if (outcome.broken_tile) {
    return terminal.fail(kFailed, "broken " + outcome.broken_tile->to_string() + "; " + kept_text, json);
  }
  if (!outcome.end) {
    const Error& error = outcome.end.error();
    const std::string also = outcome.picture.complete() ? "; " + kept_text : "";
    return terminal.fail(exit_code_of(error), error.to_string() + also, json);
  }
  if (failed) return terminal.fail(kFailed, "the render failed: " + outcome.end->message() + "; " + kept_text, json);
  if (!kept) return terminal.fail(kFailed, kept.error().to_string(), json);
  if (!whole) return terminal.fail(kFailed, "the server ended the job early; " + kept_text, json);

  const std::string warning = caution(*outcome.end);
  if (!warning.empty()) terminal.warn(warning);
  terminal.say(fmt::format("{}: {}x{}, {}, ended by {}", names.exr, json["width"].get<int>(), json["height"].get<int>(),
                           describe_end(*outcome.end), json["ended_by"].get<std::string>()));
  if (!names.png.empty()) terminal.say(names.png);
  for (const HeatMap map : names.heat_maps) terminal.say(heat_map_file(names.heatmap, map));
  terminal.result(json);
  return kOk;
}

int run(const CLI::App& app, const RenderOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  pb::RunJobRequest request;
  *request.mutable_settings() = read_settings(options.settings, reader);
  context.connection.vulkan_devices = asks_for_device(request.settings());
  *request.mutable_budget() = read_budget(options.budget, reader);
  *request.mutable_format() = read_transport(options.transport, context.connection.address, reader);
  request.set_preview_tiles(true);  // so that something is left when the render is interrupted or the server dies
  FileNames names = read_files(options.files, scene_stem(choice) + ".exr", request.settings().mode(), reader);
  add_layers(names, *request.mutable_format());
  names.denoiser = read_denoiser(options.denoiser, context.connection, *request.mutable_format(), reader);
  const auto shard =
      read_shard(options.shard, options.settings, request.settings(), request.budget(), request.format(), reader);
  const auto tev_address = read_tev(options.tev, reader);
  OutputCheck outputs;
  outputs.add_inputs(choice);
  outputs.check(names, problems);
  if (!problems.empty()) return context.refuse();

  CallControl control;
  CancellableJob job(control);
  const Interrupt interrupt([&] { job.cancel(); });
  auto opened = open_scene(context, options.settings, choice, control, interrupt, *request.mutable_settings());
  if (const int* exit_code = std::get_if<int>(&opened)) return *exit_code;
  auto& open = std::get<OpenScene>(opened);
  const pb::SceneInfo& scene = open.scene();
  set_region(shard, options.shard, *request.mutable_settings(), reader);
  if (!problems.empty()) return context.refuse();
  *request.mutable_camera() = open.camera.view();
  request.set_scene_id(scene.scene_id());

  Outcome outcome;
  outcome.origin = origin_of(request, open.server);
  const auto tev = open_tev(tev_address, request.format(), terminal);
  run_job(open.renderer.client(), request, {tev.get(), scene_stem(choice)}, terminal, control, job, outcome);

  Json json;
  // These eight come first, in this order, whatever happens later.
  for (const char* key : {"samples", "load_seconds", "render_seconds", "rays", "rays_per_path", "estimated_rmse",
                          "estimated_relmse", "invalid_samples"}) {
    json[key] = nullptr;
  }
  json["load_seconds"] = open.loaded.seconds;
  json["width"] = request.settings().width();
  json["height"] = request.settings().height();
  json["camera"] = open.camera.name();
  json["scene_id"] = scene.scene_id();
  json["triangles"] = scene.instanced_triangles();
  json["decode_seconds"] = scene.load_seconds();
  json["build_seconds"] = scene.build_seconds();
  add_load_report(json, open.loaded.response);
  for (const std::string& text : outcome.notices) json["notices"].push_back(text);
  json["notices_total"] = json["notices_total"].get<std::size_t>() + outcome.notices.size();
  close_tev(tev.get(), tev_address, json);
  json["animation"] = scene.animation().empty() ? Json(nullptr) : Json(scene.animation());
  return finish(terminal, interrupt, outcome, names, std::move(json));
}

}  // namespace

Command add_render(CLI::App& root) {
  CLI::App* app = add_command(root, "render", "Render a still until a budget of samples, time or error is reached",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<RenderOptions>();
  add_scene_options(*app, options->scene);
  add_settings_options(*app, options->settings);
  add_budget_options(*app, options->budget, "the render");
  add_file_options(*app, options->files, false);
  add_transport_options(*app, options->transport);
  add_denoiser_options(*app, options->denoiser);
  add_shard_option(*app, options->shard);
  add_tev_option(*app, options->tev);
  add_common_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
