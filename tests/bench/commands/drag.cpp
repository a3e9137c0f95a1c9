// What a person sees who drags the camera: `heliograph move --play` against a daemon on this machine.
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/peers/child_process.h"
#include "tests/bench/peers/daemon_process.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

namespace fs = std::filesystem;

struct DragScene {
  std::string name;
  fs::path file;
  double whole_goal;  // at 1280x720, share of the views
};

struct DragSize {
  const char *name, *size;
  int rate;
  const char* budget;  // ms
  bool large;
};
constexpr DragSize kSizes[] = {{"1280x720", "1280x720", 20, "45", true}, {"640x360", "640x360", 30, "28", false}};

// A turn of half a degree a view, as long as four seconds take.
Result<nlohmann::json> drag(const BenchOptions& options, const std::string& address, const fs::path& scene,
                            const DragSize& size, const fs::path& folder) {
  const std::string command = (fs::path(options.daemon).parent_path() / "heliograph").string();
  const int views = 4 * size.rate;
  auto play = ChildProcess::start({command, "move", scene.string(), "--server", address, "--size", size.size, "--turn",
                                   std::to_string(views / 2), "--steps", std::to_string(views), "--play",
                                   std::to_string(size.rate), "--preview-rate", std::to_string(size.rate),
                                   "--preview-budget", size.budget, "--samples", "16", "--json", "--output",
                                   (folder / "drag.####.exr").string()});
  if (!play) return play.error();
  std::string text;
  for (auto line = (*play)->read_line(); line; line = (*play)->read_line()) text += *line + "\n";
  if (const int code = (*play)->wait(); code != 0)
    return Error{ErrorCode::internal, "heliograph move ended with " + std::to_string(code), scene.string()};
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("play"))
    return Error{ErrorCode::internal, "heliograph move said nothing of the play", scene.string()};
  return json["play"];
}

void add(const std::string& name, const nlohmann::json& play, const char* field, const char* unit,
         std::optional<double> goal, Better better, Figures& figures) {
  if (play[field].is_number()) figures.add({name, play[field].get<double>(), unit, goal, better});
}

}  // namespace

Status run_drag(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  const fs::path glb = fs::path(options.shared) / "scenes/glb";
  std::vector<DragScene> scenes = {{"cornell", context.cornell(), 0.95},
                                   {"sponza", glb / "sponza-dabrovic.glb", 0.75},
                                   {"breakfast-room", glb / "breakfast-room.glb", 0.75}};
  if (const auto room = context.room()) {
    scenes.push_back({"room", *room, 0.6});
  } else {
    note(room.error().to_string());
  }
  auto daemon = DaemonProcess::start(options, context.folder());
  if (!daemon) return daemon.error();
  for (const DragScene& scene : scenes) {
    if (!fs::exists(scene.file)) {
      note(scene.file.string() + " is absent");
      continue;
    }
    for (const DragSize& size : kSizes) {
      const auto play = drag(options, (*daemon)->address(), scene.file, size, context.folder());
      if (!play) return play.error();
      const std::string name = "drag." + scene.name + "." + size.name;
      const std::optional<double> film_goal = size.large ? std::optional<double>(250) : std::nullopt;
      add(name + ".whole_share", *play, "whole_share", "", size.large ? scene.whole_goal : 0.93, Better::higher, figures);
      add(name + ".age_p50", *play, "age_p50_ms", "ms", std::nullopt, Better::lower, figures);
      add(name + ".age_p95", *play, "age_p95_ms", "ms", std::nullopt, Better::lower, figures);
      add(name + ".preview_whole", *play, "last_preview_whole_ms", "ms", std::nullopt, Better::lower, figures);
      add(name + ".film_first_tile", *play, "last_film_first_tile_ms", "ms", film_goal, Better::lower, figures);
      add(name + ".film_whole", *play, "last_film_whole_ms", "ms", std::nullopt, Better::lower, figures);
    }
  }
  return ok_status();
}

}  // namespace helio::bench
