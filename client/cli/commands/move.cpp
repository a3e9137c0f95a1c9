// heliograph move: a camera path, played over one stream, one picture a view.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "client/camera_path.h"
#include "client/cli/command.h"
#include "client/cli/commands/move_player.h"
#include "client/cli/commands/open_scene.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/path_option.h"
#include "client/cli/commands/picture_files.h"
#include "client/cli/commands/play_path.h"
#include "client/cli/commands/render_report.h"
#include "client/cli/denoiser_options.h"
#include "client/cli/exit_code.h"
#include "client/cli/foveation_options.h"
#include "client/cli/tev_option.h"
#include "client/server_address.h"
#include "renderer/base/clock.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr double kDegreesPerStep = 5;
constexpr std::uint32_t kPreviewQuality = 90;  // JPEG

struct MoveOptions {
  SceneOptions scene;
  TextOption path, turn, orbit, pivot, shift, steps, step;
  TextOption play, preview_rate, preview_budget, preview_jpeg, reconnect;
  bool preview_upscaling = false;
  FoveationOptions foveation;
  TextOption gaze;
  SettingsOptions settings;
  BudgetOptions budget;
  FileOptions files;
  TransportOptions transport;
  DenoiserOptions denoiser;
  TextOption tev;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Paths by name end at the camera's own view; D is its distance from --pivot, X and N are --step and --steps:\n"
    "  turn          N = 20 turns to the left by X = 5 degrees\n"
    "  orbit         N = 20 steps of X = 5 degrees around the point D ahead\n"
    "  zoom          N = 4 steps into the picture, each X = 1.189 times as large\n"
    "  translate     N = 1 steps to the right by X = 0.1 times D\n"
    "  out-and-back  N = 5 steps to the right by X = 0.02 times D and by 100 X degrees to the left, and back\n"
    "  tiny-moves    the same with N = 500, X = 0.0002 and 50 X degrees\n"
    "  jump          from a view turned by X = 120 degrees\n"
    "A path file is JSON: {\"views\": [...]}, played in order; what a view does not name stays as before. A view is\n"
    "  placed:  \"camera\": NAME, or \"position\": [x,y,z] and \"target\": [x,y,z] (and \"up\": [x,y,z])\n"
    "  or moved: \"turn_degrees\": A (positive: left), \"orbit_degrees\": A (around \"pivot\": [x,y,z]),\n"
    "           \"move\": [right, up, forward] in scene units\n"
    "  lens:    \"fov_degrees\": A (vertical), \"lens_radius\": L, \"focus_distance\": L\n"
    "  gaze:    \"gaze\": [x,y] in pixels from the upper left corner, or null; with --foveation\n"
    "  budget:  \"samples\": N, \"time_s\": T, \"error\": E, for this view instead of the command's\n"
    "  again:   \"repeat\": N\n"
    "Example: {\"views\": [{\"samples\": 256}, {\"turn_degrees\": 5, \"samples\": 64, \"repeat\": 20}]}\n"
    "With --json, stdout holds one object: load_seconds, seconds, frames: [{view, output, samples, render_seconds,\n"
    "first_tile_seconds (from sending the view to its first tile here), rays, rays_per_path, estimated_rmse,\n"
    "estimated_relmse, invalid_samples, ended_by, reuse_share (of the samples, from earlier pictures),\n"
    "verification_rays, pass_seconds (processor time of each pass), ...}], and with --tev tev: {address, image,\n"
    "updates, warning}.\n"
    "--play shows the path as a mouse drag is seen: views leave at fixed moments, the budget is the command's, and "
    "the\n"
    "last view's film is written, no preview. Previews are whole pictures for the eye, biased, and never part of the\n"
    "film. The JSON then has play: {views,\n"
    "views_with_a_tile, whole_pictures (while moving), whole_share, whole_per_second, skipped_views, previews,\n"
    "age_p50_ms, age_p95_ms (of what is shown, from sending its view), last_preview_whole_ms, "
    "last_film_first_tile_ms,\n"
    "last_film_whole_ms (from sending the last view)}.\n"
    "--mode reproject carries what is still true of a view into the next one; combined, the default where it goes "
    "with\n"
    "the other options, also sends samples where they are missing; pt starts over.\n"
    "Ctrl-C keeps the pictures of the views so far, the unfinished one included; a second Ctrl-C ends at once.\n"
    "Example: heliograph move room.glb --orbit 90 --steps 30 --samples 32 --png shot.png\n"
    "Example: heliograph move room.glb --turn 40 --steps 80 --play 20\n\n";

void add_path_options(CLI::App& app, MoveOptions& options) {
  add_path_option(
      app, options.path,
      "turn, orbit, zoom, translate, out-and-back, tiny-moves, jump, or a camera path file (./turn is one of that "
      "name); described below");
  add_text(app, options.turn, "--turn", "DEGREES",
           "Turn the camera on the spot, positive to the left, in --steps steps");
  add_text(app, options.orbit, "--orbit", "DEGREES",
           "Carry the camera around --pivot, positive counter-clockwise from above, in --steps steps");
  add_text(app, options.pivot, "--pivot", "x,y,z",
           "Centre of orbits, those of a path file included that name none, and what paths by name measure distance "
           "to. Default: centre of the scene's bounds");
  add_text(app, options.shift, "--move", "r,u,f",
           "Shift the camera right, up and forward along its own axes, scene units, in --steps steps");
  add_text(app, options.steps, "--steps", "N",
           "Steps of the whole motion, [1, 100000]; N + 1 pictures, the start included. Default: one for each 5 "
           "degrees, at least 1; of a path by name its own");
  add_text(app, options.step, "--step", "X",
           "Size of a step of a path by name: degrees in [-360, 360] (turn, orbit, jump), magnification in [0.01, 100] "
           "(zoom) or share of the distance in [-100, 100] (the others)");
}

void add_preview_options(CLI::App& app, MoveOptions& options) {
  add_text(
      app, options.play, "--play", "HZ",
      "Play the path in real time, HZ views a second, (0, 240], after 2 s at the first view; keep the last picture");
  add_text(app, options.preview_rate, "--preview-rate", "HZ",
           "Previews a second while the camera moves, [0, 120]; 0: none. Default: 0, with --play 20");
  add_text(app, options.preview_budget, "--preview-budget", "MS",
           "Time that a preview may take, milliseconds in [5, 1000]. Default: 45");
  add_text(app, options.preview_jpeg, "--preview-jpeg", "Q",
           "Previews come as JPEG of this quality, [1, 100]. Default: as EXR in process and on loopback, 90 otherwise");
  add_flag(app, options.preview_upscaling, "--preview-upscaling",
           "Previews trace surfaces in every second pixel along either axis, and in all along edges");
}

void add_gaze_options(CLI::App& app, MoveOptions& options) {
  add_foveation_options(app, options.foveation);
  add_text(app, options.gaze, "--gaze", "x,y",
           "Where somebody looks, pixels from the picture's upper left corner, with --foveation. Default: its centre");
}

// The gaze that is asked for; none: none is, or the picture's centre is meant.
std::optional<pb::Gaze> read_gaze(const MoveOptions& options, OptionReader& reader, pb::RenderSettings& settings) {
  const bool foveated = read_foveation(options.foveation, reader, settings);
  const auto gaze = read_point(options.gaze, reader);
  if (options.gaze.given() && !foveated)
    reader.problem(options.gaze, "is only valid with --foveation density and --foveation paper");
  return gaze;
}

// Refuses options of previews when no previews are made.
void check_previews(const MoveOptions& options, OptionReader& reader, const pb::RenderSettings& settings) {
  static constexpr const char* kOnly = "is only valid with --preview-rate above 0, or with --play";
  if (settings.preview_rate() > 0) return;
  for (const TextOption* option : {&options.preview_budget, &options.preview_jpeg})
    if (option->given()) reader.problem(*option, kOnly);
  if (options.preview_upscaling) reader.problems().add("--preview-upscaling", kOnly);
  if (settings.foveation() == pb::FOVEATION_PAPER) reader.problem(options.foveation.kind, std::string("paper ") + kOnly);
}

bool asks_for_mode(const SettingsOptions& options) {
  const auto mode = options.fields.find("mode");
  return mode != options.fields.end() && mode->second.given();
}

// In mode combined if no mode is asked for and the others go with it; else pt. Problems are those of the mode that has
// fewer.
pb::RenderSettings read_moving_settings(const SettingsOptions& options, OptionReader& reader) {
  if (asks_for_mode(options)) return read_settings(options, reader);
  Problems of_combined, of_pt;
  OptionReader combined_reader(of_combined), pt_reader(of_pt);
  const pb::RenderSettings combined = read_settings(options, combined_reader, pb::MODE_COMBINED);
  if (of_combined.empty()) return combined;
  const pb::RenderSettings pt = read_settings(options, pt_reader, pb::MODE_PT);
  const bool choose_pt = of_pt.size() < of_combined.size();
  for (const Problems::Item& item : (choose_pt ? of_pt : of_combined).items())
    reader.problems().add(item.where, item.message);
  return choose_pt ? pt : combined;
}

// Sets the previews that are asked for, or that playing in real time has by default. Returns views a second; none: one
// picture a view.
std::optional<double> read_play(const MoveOptions& options, OptionReader& reader, pb::RenderSettings& settings) {
  const auto play = reader.number(options.play, {0, 240, false});
  if (const auto rate = reader.number(options.preview_rate, {0, 120})) settings.set_preview_rate(*rate);
  if (const auto budget = reader.number(options.preview_budget, {5, 1000})) settings.set_preview_budget_ms(*budget);
  if (play && !options.preview_rate.given()) settings.set_preview_rate(20);
  if (options.preview_upscaling) settings.set_preview_upscaling(true);
  return play;
}

CameraMotion read_motion(const MoveOptions& options, const PathScale& scale, OptionReader& reader) {
  CameraMotion motion;
  motion.turn_degrees = reader.number(options.turn, {-360000, 360000}).value_or(0);
  motion.orbit_degrees = reader.number(options.orbit, {-360000, 360000}).value_or(0);
  motion.move = reader.vector(options.shift).value_or(V3d(0, 0, 0));
  const double largest = std::max(std::abs(motion.turn_degrees), std::abs(motion.orbit_degrees));
  motion.steps = std::max(1, static_cast<int>(std::ceil(largest / kDegreesPerStep - 1e-9)));
  if (scale.steps) motion.steps = *scale.steps;
  if (options.pivot.given() && !options.orbit.given() && !options.path.given()) {
    reader.problem(options.pivot, "is only valid with --orbit or --path: nothing else turns around it");
  }
  const bool moves = options.turn.given() || options.orbit.given() || options.shift.given();
  if (is_path_by_name(options.path)) {
    if (moves) reader.problem(options.path, "does not go with --turn, --orbit and --move");
  } else if (options.path.given() && (moves || options.steps.given())) {
    reader.problem(options.path, "does not go with --turn, --orbit, --move and --steps");
  }
  if (!options.path.given() && !moves) reader.problems().add("--path", "or one of --turn, --orbit, --move is required");
  return motion;
}

// Writes the view's picture and describes it. `json` gets the members of render's.
Status keep_view(PlayedView& view, const FileNames& names, Json& json) {
  if (view.end) add_frame_end(json, *view.end);
  json["first_tile_seconds"] = view.first_tile_seconds;
  json["tiles"] = view.picture.tiles();
  json["bytes"] = view.picture.bytes();
  if (!view.picture.complete()) return Error{ErrorCode::internal, "not every tile of the view has come", {}};
  json["samples"] = view.picture.samples_per_pixel();
  const auto picture = view.picture.picture();
  if (!picture) return picture.error();
  return write_files(names, **picture, view.unsampled, json);
}

// Whether the view came to its end.
Status check_end(const pb::FrameEnd& end, int view) {
  if (end.reason() == pb::END_REASON_FAILED) {
    return Error{ErrorCode::internal, fmt::format("view {} failed: {}", view, end.message()), {}};
  }
  if (end.reason() == pb::END_REASON_CANCELLED) {
    return Error{ErrorCode::unavailable, fmt::format("the server ended view {} early", view), {}};
  }
  return ok_status();
}

// What the pictures are played with.
struct Play {
  MovePlayer& player;
  const std::vector<PathView>& views;
  const FileNames& patterns;
  double time_s = 0;
};

// Each view is sent before the picture of the one before it is written: the server renders meanwhile.
Status play_views(const Play& play, Terminal& terminal, Json& frames) {
  Status sent = play.player.send(play.views.front(), play.time_s);
  std::set<std::string> said;  // of notices; views of the same camera have the same
  for (std::size_t i = 0; i < play.views.size(); ++i) {
    if (!sent) return sent;
    PlayedView view;
    const Status awaited = play.player.await(view);
    if (awaited && i + 1 < play.views.size()) sent = play.player.send(play.views[i + 1], play.time_s);

    const int number = static_cast<int>(i);
    const FileNames names = numbered(play.patterns, number);
    Json json;
    json["view"] = number;
    json["partial"] = !awaited;
    // Of the scene, and so the same of all views.
    for (const std::string& text : i == 0 ? view.unsampled : Unsampled()) terminal.say("notice: " + single_line(text));
    for (const std::string& text : view.notices)
      if (said.insert(text).second) terminal.say("notice: " + single_line(text));
    json["notices"] = view.notices;
    const bool any = awaited || view.picture.complete();
    const Status kept = any ? keep_view(view, names, json) : ok_status();
    if (any) frames.push_back(json);
    if (!awaited) return awaited;
    if (!kept) return kept;
    if (const Status ended = check_end(*view.end, number); !ended) return ended;
    const std::string warning = caution(*view.end);
    if (!warning.empty()) terminal.warn(fmt::format("view {}: {}", number, warning));
    terminal.say(fmt::format("{}: {}", names.exr, describe_end(*view.end)));
  }
  return ok_status();
}

struct RealTime {
  const pb::TileFormat& format;
  const std::vector<PathView>& views;
  const FileNames& patterns;
  double rate, time_s, patience_s;
  TevBridge* tev;
};

// The path in real time, and the film's picture of its last view.
Status play_and_keep(RenderClient& client, const pb::CreateSessionResponse& session, const RealTime& what,
                     const Interrupt& interrupt, Terminal& terminal, Json& json, Json& frames) {
  const pb::RenderSettings& settings = session.settings();
  RealTimePlay play;
  play.rate = what.rate;
  play.time_s = what.time_s;
  play.patience_s = what.patience_s;
  play.pixels = std::int64_t(settings.width()) * settings.height();
  if (settings.has_region()) {
    const pb::Rect& region = settings.region();
    play.pixels = std::int64_t(region.x1() - region.x0()) * (region.y1() - region.y0());
  }
  Json shown;
  PlayedView last;
  const Status played = play_in_real_time(client, session.session_id(), what.format, what.views, play, interrupt,
                                          terminal, what.tev, shown, last);
  if (!shown.is_null()) {
    terminal.say(describe_shown(shown));
    json["play"] = shown;
  }
  for (const std::string& text : last.unsampled) terminal.say("notice: " + single_line(text));
  for (const std::string& text : last.notices) terminal.say("notice: " + single_line(text));
  if (!last.picture.complete()) return played;
  Json frame;
  const int number = static_cast<int>(what.views.size()) - 1;
  const FileNames names = numbered(what.patterns, number);
  frame["view"] = number;
  frame["partial"] = !last.end.has_value();
  frame["notices"] = last.notices;
  const Status kept = keep_view(last, names, frame);
  if (kept) frames.push_back(frame);
  if (!played || !kept) return played ? kept : played;
  if (const Status ended = check_end(*last.end, number); !ended) return ended;
  if (const std::string warning = caution(*last.end); !warning.empty()) terminal.warn(warning);
  terminal.say(fmt::format("{}: {}", names.exr, describe_end(*last.end)));
  return ok_status();
}

int run(const CLI::App& app, const MoveOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  const PathScale scale = read_path_scale(options.path, options.steps, options.step, reader);
  const CameraMotion motion = read_motion(options, scale, reader);
  const std::string path_text = read_path_file(options.path, reader);
  const auto pivot = reader.vector(options.pivot);
  pb::CreateSessionRequest request;
  *request.mutable_settings() = read_moving_settings(options.settings, reader);
  context.connection.vulkan_devices = asks_for_device(request.settings());
  *request.mutable_budget() = read_budget(options.budget, reader);
  const std::size_t problems_before = problems.size();
  const auto play_rate = read_play(options, reader, *request.mutable_settings());
  const bool knows_previews = problems.size() == problems_before;
  auto gaze = read_gaze(options, reader, *request.mutable_settings());
  if (knows_previews) check_previews(options, reader, request.settings());
  pb::TileFormat format = read_transport(options.transport, context.connection.address, reader);
  FileNames patterns = read_files(options.files, scene_stem(choice) + ".####.exr", request.settings().mode(), reader);
  add_layers(patterns, format);
  // Previews show the film of the last rest as it was shown there.
  if (play_rate && !patterns.raw) format.set_display(true);
  patterns.denoiser = read_denoiser(options.denoiser, context.connection, format, reader);
  // Over a network, where compressing a preview as EXR would take longer than making it.
  const bool far = !context.connection.address.empty() && !is_loopback(context.connection.address);
  if (far && request.settings().preview_rate() > 0) format.set_preview_jpeg(kPreviewQuality);
  if (const auto quality = reader.integer(options.preview_jpeg, 1, 100))
    format.set_preview_jpeg(static_cast<std::uint32_t>(*quality));
  const double patience_s = reader.number(options.reconnect, {0, 3600}).value_or(ReattachOptions().patience_s);
  const auto tev_address = read_tev(options.tev, reader);
  OutputCheck outputs;
  outputs.add_inputs(choice);
  add_path_input(options.path, outputs);
  OutputCheck(outputs).check(numbered(patterns, 0), problems);
  if (!problems.empty()) return context.refuse();
  if (!asks_for_mode(options.settings) && request.settings().mode() == pb::MODE_PT) {
    const bool previews = request.settings().preview_rate() > 0;
    terminal.say(
        std::string("notice: move renders in mode combined by default, which does not go with these settings: ") +
        "mode is pt" + (previews ? ", with previews" : ""));
  }

  CallControl control;
  std::mutex player_mutex;
  MovePlayer* playing = nullptr;
  const Interrupt interrupt([&] {
    control.cancel();
    std::lock_guard lock(player_mutex);
    if (playing) playing->cancel();
  });
  auto opened = open_scene(context, options.settings, choice, control, interrupt, *request.mutable_settings());
  if (const int* exit_code = std::get_if<int>(&opened)) return *exit_code;
  auto& open = std::get<OpenScene>(opened);
  RenderClient& client = open.renderer.client();
  const pb::SceneInfo& scene = open.scene();
  if (request.settings().foveation() > pb::FOVEATION_NONE && !gaze) gaze = centre_of_film(request.settings());
  const PathStart start{open.camera.view(), pivot.value_or(centre_of(scene)), cameras_of(scene), gaze};
  const auto views =
      options.path.given() ? read_path_views(options.path, path_text, scale, start) : play_motion(motion, start);
  if (!views) return terminal.fail(kUsage, views.error().to_string());
  for (std::size_t i = 0; i < views->size() && problems.empty(); ++i) {
    outputs.check(numbered(patterns, static_cast<int>(i)), problems);
  }
  if (!problems.empty()) return context.refuse();

  request.set_scene_id(scene.scene_id());
  const auto session = client.create_session(request);
  if (!session) return context.fail(session.error());

  const auto tev = open_tev(tev_address, format, terminal);
  if (tev) tev->set_name(scene_stem(choice), session->session_id());
  Json json;
  json["load_seconds"] = open.loaded.seconds;
  json["seconds"] = 0.0;
  json["width"] = session->settings().width();
  json["height"] = session->settings().height();
  Json frames = Json::array();
  const double begun = now_s();
  Status played = ok_status();
  if (play_rate) {
    const RealTime what{format, *views, patterns, *play_rate, choice.time_s, patience_s, tev.get()};
    played = play_and_keep(client, *session, what, interrupt, terminal, json, frames);
  } else {
    MovePlayer player(client, session->session_id(), format, request.budget(), patience_s, terminal, tev.get());
    {
      std::lock_guard lock(player_mutex);
      playing = &player;
    }
    if (interrupt.raised()) player.cancel();
    played = play_views({player, *views, patterns, choice.time_s}, terminal, frames);
    {
      std::lock_guard lock(player_mutex);
      playing = nullptr;
    }
    if (played) played = player.close();
  }
  if (!played) static_cast<void>(client.close_session(session->session_id()));
  json["seconds"] = now_s() - begun;
  json["frames"] = frames;
  close_tev(tev.get(), tev_address, json);
  add_load_report(json, open.loaded.response);
  const std::string kept = fmt::format("; {} of {} pictures are written", frames.size(), views->size());
  if (interrupt.raised() && !played) return terminal.fail(interrupt.exit_code(), "interrupted" + kept, json);
  if (!played) return terminal.fail(exit_code_of(played.error()), played.error().to_string() + kept, json);
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_move(CLI::App& root) {
  CLI::App* app = add_command(root, "move", "Move the camera over one stream and keep a picture of each view",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<MoveOptions>();
  add_scene_options(*app, options->scene);
  add_path_options(*app, *options);
  add_preview_options(*app, *options);
  add_gaze_options(*app, *options);
  add_settings_options(*app, options->settings);
  add_budget_options(*app, options->budget, "each view");
  add_file_options(*app, options->files, true);
  add_transport_options(*app, options->transport);
  add_denoiser_options(*app, options->denoiser);
  add_tev_option(*app, options->tev);
  add_text(*app, options->reconnect, "--reconnect", "SECONDS",
           "Ask a daemon that restarts (heliographd --state) for the session for so long, [0, 3600]. Default: 60");
  add_common_options(*app, options->common, "One JSON object on stdout, described below");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
