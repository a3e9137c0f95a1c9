// heliograph info: what this renderer or a daemon is, its limits, scenes and sessions.
#include <spdlog/fmt/fmt.h>

#include <memory>

#include "client/cli/command.h"
#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/terminal.h"
#include "client/enum_names.h"
#include "server/app/machine_info.h"

namespace helio::cli {

namespace {

struct InfoOptions {
  ConnectionOptions connection;
  bool json = false;
};

Json to_json(const pb::Device& device) {
  Json json = {{"kind", device.kind()}, {"name", device.name()}};
  if (device.kind() != "vulkan") return json;
  json["device"] = fmt::format("vulkan:{}", device.index());
  json["driver"] = device.driver();
  json["type"] = device.type();
  json["path_tracing"] = device.path_tracing().empty() ? Json(nullptr) : Json(device.path_tracing());
  json["reason"] = device.reason().empty() ? Json(nullptr) : Json(device.reason());
  json["memory_bytes"] = device.memory_bytes();
  json["max_allocation_bytes"] = device.max_allocation_bytes();
  json["api_version"] = device.api_version();
  json["device_uuid"] = device.device_uuid();
  json["driver_uuid"] = device.driver_uuid();
  return json;
}

Json to_json(const pb::GetServerInfoResponse& info) {
  Json json;
  json["version"] = info.version();
  json["build"] = info.build();
  json["isa"] = info.isa();
  json["devices"] = Json::array();
  for (const pb::Device& device : info.devices()) json["devices"].push_back(to_json(device));
  json["no_vulkan_reason"] = info.no_vulkan_reason().empty() ? Json(nullptr) : Json(info.no_vulkan_reason());
  json["threads"] = info.threads();
  json["modes"] = Json::array();
  for (const int mode : info.modes()) json["modes"].push_back(to_short_name(static_cast<pb::Mode>(mode)));
  json["integrators"] = Json::array();
  for (const int integrator : info.integrators())
    json["integrators"].push_back(to_short_name(static_cast<pb::Integrator>(integrator)));
  json["scene_formats"] = Json::array();
  for (const std::string& format : info.scene_formats()) json["scene_formats"].push_back(format);
  const pb::Limits& limits = info.limits();
  json["limits"] = {{"max_scene_bytes", limits.max_scene_bytes()},
                    {"max_scene_memory", limits.max_scene_memory()},
                    {"max_film_side", limits.max_film_side()},
                    {"max_film_pixels", limits.max_film_pixels()},
                    {"max_sessions", limits.max_sessions()},
                    {"max_jobs", limits.max_jobs()},
                    {"max_queued_jobs", limits.max_queued_jobs()},
                    {"max_memory", limits.max_memory()},
                    {"max_message_bytes", limits.max_message_bytes()},
                    {"max_scenes", limits.max_scenes()}};
  json["keeps_jobs"] = info.keeps_jobs();
  json["draining"] = info.draining();
  json["uptime_s"] = info.uptime_s();
  return json;
}

Json to_json(const pb::ListScenesResponse& scenes) {
  Json json = Json::array();
  for (const pb::SceneInfo& scene : scenes.scenes()) {
    json.push_back({{"scene_id", scene.scene_id()},
                    {"name", scene.name()},
                    {"triangles", scene.triangles()},
                    {"memory_bytes", scene.memory_bytes()},
                    {"edited_from", scene.edited_from().empty() ? Json(nullptr) : Json(scene.edited_from())},
                    {"own_bytes", scene.own_bytes()},
                    {"references", scene.references()}});
  }
  return json;
}

Json to_json(const pb::ListSessionsResponse& sessions) {
  Json json = Json::array();
  for (const pb::SessionInfo& session : sessions.sessions()) {
    json.push_back({{"session_id", session.session_id()},
                    {"scene_id", session.scene_id()},
                    {"width", session.settings().width()},
                    {"height", session.settings().height()},
                    {"attached", session.attached()},
                    {"samples", session.progress().samples_per_pixel()},
                    {"memory_bytes", session.memory_bytes()},
                    {"used_seconds", session.used_seconds()}});
  }
  return json;
}

Json to_json(const MachineInfo& machine) {
  Json json;
  json["processor"] = machine.processor.empty() ? Json(nullptr) : Json(machine.processor);
  json["threads"] = machine.threads;
  json["instruction_sets"] = machine.instruction_sets;
  json["compiled_for"] = machine.compiled_for;
  json["traversal"] = machine.traversal;
  for (const auto& [name, version] : machine.libraries) json["libraries"][name] = version;
  return json;
}

void say(Terminal& terminal, const MachineInfo& machine) {
  terminal.say(fmt::format("  processor: {}, {} threads, {}", machine.processor.empty() ? "unnamed" : machine.processor,
                           machine.threads, join(machine.instruction_sets, " ")));
  terminal.say(
      fmt::format("  instruction sets used: {} by the kernels, {} by Embree", machine.compiled_for, machine.traversal));
  std::vector<std::string> libraries;
  for (const auto& [name, version] : machine.libraries) libraries.push_back(name + " " + version);
  terminal.say("  libraries: " + join(libraries, ", "));
}

void say(Terminal& terminal, const pb::Device& device) {
  if (device.kind() != "vulkan") {
    terminal.say("  " + device.kind() + ": " + device.name());
    return;
  }
  const std::string paths = device.path_tracing().empty() ? "no path tracing" : "path tracing by " + device.path_tracing();
  terminal.say(fmt::format("  vulkan:{}: {} ({}), {}; {}B, {}{}", device.index(), device.name(), device.type(),
                           device.driver(), human_count(double(device.memory_bytes())), paths,
                           device.reason().empty() ? "" : ": " + device.reason()));
}

void say(Terminal& terminal, const pb::GetServerInfoResponse& info, const Json& json) {
  terminal.say(fmt::format("heliograph {} ({}, {}), {} threads{}", info.version(), info.build(), info.isa(),
                           info.threads(), info.draining() ? ", draining" : ""));
  for (const pb::Device& device : info.devices()) say(terminal, device);
  if (!info.no_vulkan_reason().empty()) terminal.say("  no Vulkan device: " + info.no_vulkan_reason());
  std::vector<std::string> modes;
  for (const int mode : info.modes()) modes.push_back(to_short_name(static_cast<pb::Mode>(mode)));
  terminal.say("  modes: " + join(modes, ", "));
  std::vector<std::string> integrators;
  for (const int value : info.integrators()) integrators.push_back(to_short_name(static_cast<pb::Integrator>(value)));
  if (!integrators.empty()) terminal.say("  integrators: " + join(integrators, ", "));
  terminal.say("  scene formats: " + join({info.scene_formats().begin(), info.scene_formats().end()}, ", "));
  const pb::Limits& limits = info.limits();
  terminal.say(fmt::format("  limits: scene {}B, memory {}B, film {} pixels with sides up to {}, {} sessions, {} jobs",
                           human_count(double(limits.max_scene_bytes())), human_count(double(limits.max_memory())),
                           human_count(double(limits.max_film_pixels())), limits.max_film_side(), limits.max_sessions(),
                           limits.max_jobs()));
  if (info.keeps_jobs())
    terminal.say(fmt::format("  keeps jobs that are submitted, of which at most {} wait", limits.max_queued_jobs()));
  for (const Json& scene : json["scenes"]) {
    const bool edited = !scene["edited_from"].is_null();
    terminal.say(
        fmt::format("  scene {}: {}{}, {} triangles, {}B{}, used by {}", scene["scene_id"].get<std::string>(),
                    scene["name"].get<std::string>(), edited ? " (edited)" : "",
                    human_count(scene["triangles"].get<double>()), human_count(scene["memory_bytes"].get<double>()),
                    edited ? fmt::format(" of which {}B its own", human_count(scene["own_bytes"].get<double>())) : "",
                    scene["references"].get<int>()));
  }
  for (const Json& session : json["sessions"]) {
    terminal.say(fmt::format("  session {}: {}x{}, {} samples, {}", session["session_id"].get<std::string>(),
                             session["width"].get<int>(), session["height"].get<int>(), session["samples"].get<int>(),
                             session["attached"].get<bool>() ? "attached" : "waiting"));
  }
}

int run(const CLI::App& app, const InfoOptions& options) {
  Terminal terminal(options.json);
  Problems problems;
  OptionReader reader(problems);
  report_unknown(app, reader);
  Connection connection = read_connection(options.connection, reader);
  connection.vulkan_devices = true;  // to list them
  if (!problems.empty()) return terminal.fail(kUsage, problems.to_error().message);

  Result<Renderer> renderer = Renderer::open(connection);
  if (!renderer) return terminal.fail(exit_code_of(renderer.error()), renderer.error().to_string());
  RenderClient& client = renderer->client();
  const auto info = client.server_info();
  if (!info) return terminal.fail(exit_code_of(info.error()), info.error().to_string());
  const auto scenes = client.list_scenes();
  if (!scenes) return terminal.fail(exit_code_of(scenes.error()), scenes.error().to_string());
  const auto sessions = client.list_sessions();
  if (!sessions) return terminal.fail(exit_code_of(sessions.error()), sessions.error().to_string());

  Json json = to_json(*info);
  json["server"] = connection.address.empty() ? Json(nullptr) : Json(connection.address);
  json["scenes"] = to_json(*scenes);
  json["sessions"] = to_json(*sessions);
  say(terminal, *info, json);
  if (renderer->in_process()) {
    const MachineInfo machine = machine_info();
    json["machine"] = to_json(machine);
    say(terminal, machine);
  }
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_info(CLI::App& root) {
  CLI::App* app =
      add_command(root, "info", "Tell version, limits and machine of this program, or of a daemon", kExitCodesHelp);
  auto options = std::make_shared<InfoOptions>();
  add_connection_options(*app, options->connection);
  add_flag(*app, options->json, "--json", "One JSON object on stdout");
  allow_unknown(*app);
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
