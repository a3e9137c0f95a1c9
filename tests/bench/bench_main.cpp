// helio_bench: measures what tests/bench/README.md lists.
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "tests/bench/scenes/reuse_motions.h"
#include "tests/bench/subcommands.h"

namespace {

using namespace helio;
using namespace helio::bench;

struct Subcommand {
  const char* name;
  const char* help;
  Status (*run)(BenchContext&, Figures&);
  bool of_scenes = false;  // takes scenes, --seeds, --samples and --cache
  bool in_all = true;      // of `all`
};
const Subcommand kSubcommands[] = {
    {"speed", "time per sample and time to relMSE 0.01, over Mitsuba", run_speed},
    {"rays", "rays per second over bare Embree calls on the same rays", run_rays},
    {"load", "loading the 1.02 M triangle room, over reading it and a bare Embree build", run_load},
    {"latency", "view sent to first tile received", run_latency},
    {"lamps", "error x time in a hall of 1, 100 and 10,000 lamps", run_lamps, false, false},
    {"drag", "whole pictures, and their age, while a camera is dragged in real time", run_drag, false, false},
    {"viewer", "what a person at the viewer waits for, in Chromium on this machine", run_viewer, false, false},
    {"python", "the Python package: import, tiles to numpy, a picture beside its render", run_python, false, false},
    {"tev", "the sender of --tev, and rendering with a viewer that is absent, blocked or connected", run_tev, false,
     false},
    {"display", "the layer display: error over the film's, the error that it tells, and its time", run_display, true,
     false},
    {"denoisers", "the layer display and Open Image Denoise over the film at equal processor time", run_denoisers, true,
     false},
    {"previews", "previews of a drag over one sample a pixel in the same time: error and flicker", run_previews, true,
     false},
    {"foveated", "what a gaze changes: time, FLIP and flicker of previews, a film's error over time", run_foveated, true,
     false},
    {"cancel", "stream given up to the last work done for it", run_cancel},
    {"stream", "processor share of streaming 10 pictures a second", run_stream},
    {"service", "jobs that the daemon keeps: checkpoints, submissions, lists, a restart", run_service, false, false},
    {"sessions", "fairness and memory of 8 sessions on one scene", run_sessions},
    {"features", "what the kernel chosen for a scene earns over the general one", run_features},
    {"metrics", "time of FLIP on pictures of 1280x720, on one thread", run_metrics},
    {"bidir", "time to a given error with light paths and without, over Mitsuba", run_bidir, true},
    {"adaptive", "mode adaptive over uniform counts, as a share of the possible", run_adaptive, true, false},
    {"reuse", "time to a restart's error after a camera move", run_reuse, true, false},
    {"vulkan", "path tracing on a Vulkan device, by our own BVH and by the ray-tracing pipeline, over the processor",
     run_vulkan, false, false},
};

struct ComparisonSubcommand {
  const char* name;
  const char* help;
  Result<std::vector<pb::CompareRecord>> (*run)(BenchContext&);
};
const ComparisonSubcommand kComparisons[] = {
    {"peers", "error against time and samples of every mode beside Mitsuba, on the same XML files", run_peers},
    {"turns", "error against time of the last view of a turn, of reprojection as published and ours", run_turns},
};

const Subcommand kRealScenes = {"peers --real", "", run_real};  // figures instead of the comparisons of `peers`

constexpr int kSkipped = 77;  // exit code: the pictures of ../shared are absent (CTest's skip)

std::string from_environment(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value && *value ? value : otherwise;
}

int run_comparison(const BenchOptions& options, const ComparisonSubcommand& subcommand, bool as_json) {
  BenchContext context(options);
  const auto records = subcommand.run(context);
  const Status done = records ? publish_comparisons(*records, as_json, options.output) : Status(records.error());
  if (!done) note(std::string(subcommand.name) + " failed: " + done.error().to_string());
  return done ? 0 : 1;
}

// Default of --cache where HELIO_BENCH_CACHE names none.
std::string cache_folder() {
  const std::string home = from_environment("HOME", ".");
  return from_environment("XDG_CACHE_HOME", home + "/.cache") + "/heliograph/references";
}

void add_scene_options(CLI::App& command, BenchOptions& options) {
  command.add_option("SCENE", options.scenes, "Scene files, or names of scenes/bench and of our own scenes");
  command.add_option("--seeds", options.seeds, "Pictures per point; intervals are over these")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--samples", options.samples, "Samples a pixel; of comparisons: of the last point after 1, 2, ...")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  command.add_flag("--own-references", options.own_references,
                   "Pass by references of other renderers: pictures are of --size, held against our own");
  command
      .add_option("--cache", options.cache, "Folder that keeps references and scenes made here; also HELIO_BENCH_CACHE")
      ->capture_default_str();
}

// Before references are rendered, which may take hours.
std::string check_motion(const std::string& text) {
  if (text == "all") return "";
  const auto motion = reuse_motion(text, CameraPose(), 1);
  return motion ? "" : motion.error().to_string();
}

void add_reuse_options(CLI::App& command, BenchOptions& options) {
  command
      .add_option("--motions", options.motions,
                  "Camera motions, separated by commas, or all; NAME@N: N samples at each of several steps. Default: "
                  "those with goals")
      ->delimiter(',')
      ->check(check_motion);
  command.add_flag("--ours-alone", options.ours_alone,
                   "Mode combined beside the restart, without other modes and costs: for biases and limits, which take "
                   "many seeds");
}

void add_turn_options(CLI::App& command, BenchOptions& options) {
  command.add_option("--degrees", options.step_degrees, "Degrees a step, of 5, 10, 20, 50")
      ->delimiter(',')
      ->capture_default_str();
  command.add_option("--step-samples", options.step_samples, "Samples a pixel at each step")
      ->delimiter(',')
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
}

void add_peer_options(CLI::App& command, BenchOptions& options) {
  command.add_flag("--real", options.real,
                   "Figures of sponza-dabrovic, breakfast-room and kitchen-partial, or the SCENEs among these, at "
                   "640x360, over Mitsuba, Cycles and bare Embree");
  command.add_option("--bpy-python", options.bpy_python,
                     "Python with bpy 5.0.1, for --real; also HELIO_BPY_PYTHON. Without it the figures over Cycles are "
                     "left out");
}

// Those that give figures: by its name, or of `all`.
std::vector<Subcommand> chosen_subcommands(const BenchOptions& options, const std::string& chosen) {
  if (options.real) return {kRealScenes};
  std::vector<Subcommand> subcommands;
  for (const Subcommand& subcommand : kSubcommands) {
    if (chosen == "all" ? subcommand.in_all : chosen == subcommand.name) subcommands.push_back(subcommand);
  }
  return subcommands;
}

int run(const BenchOptions& options, const std::vector<Subcommand>& subcommands, bool as_json) {
  if (!std::filesystem::exists(std::filesystem::path(options.shared) / "scenes/bench/cornell.gltf")) {
    note("skipped: " + options.shared + "/scenes/bench is absent (--shared, HELIO_SHARED)");
    return from_environment("CI", "") == "true" ? 1 : kSkipped;
  }
  if (options.repeat < 5) note("fewer than 5 repetitions: not a measurement");

  BenchContext context(options);
  Figures figures;
  bool failed = false;
  for (const Subcommand& subcommand : subcommands) {
    if (const Status done = subcommand.run(context, figures); !done) {
      note(std::string(subcommand.name) + " failed: " + done.error().to_string());
      failed = true;
    }
  }
  std::printf("%s\n", as_json ? figures.json().c_str() : figures.table().c_str());
  return failed ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  BenchOptions options;
  options.shared = from_environment("HELIO_SHARED", HELIO_BENCH_SHARED);
  options.mitsuba_python = from_environment("HELIO_MITSUBA_PYTHON", "");
  options.bpy_python = from_environment("HELIO_BPY_PYTHON", "");
  options.blender = from_environment("HELIO_BLENDER", "blender");
  options.daemon = HELIO_BENCH_DAEMON;
  options.oidn_library = from_environment("HELIOGRAPH_OIDN", "");
  options.cache = from_environment("HELIO_BENCH_CACHE", cache_folder());
  for (int i = 0; i < argc; ++i) options.command_line += (i ? " " : "") + std::string(argv[i]);
  bool as_json = false;

  CLI::App app("Measures Heliograph against the figures of tests/bench/README.md. Notes go to stderr.", "helio_bench");
  app.require_subcommand(1);
  app.fallthrough();
  app.add_flag("--json", as_json,
               "Print {\"figures\": {name: {value, unit, goal, better}}}, or {\"comparisons\": [...]}; else tables");
  app.add_option("--threads", options.threads, "Threads of ours and of the peers")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--repeat", options.repeat, "Measurements after one warm-up; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--size", options.size,
                 "Side of the pictures of speed, rays and features, height of references made here; goals hold for 512")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  app.add_option("--views", options.views, "Camera updates per latency figure, and tries of cancel if more than 200")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--shared", options.shared, "Folder with scenes/bench; also HELIO_SHARED")->capture_default_str();
  app.add_option("--mitsuba-python", options.mitsuba_python,
                 "Python with Mitsuba 3.9.1 and numpy; also HELIO_MITSUBA_PYTHON. Without it the figures over Mitsuba "
                 "are left out, and the room's unless python3 has numpy");
  app.add_option("--blender", options.blender,
                 "Blender, for the figures of Cycles; also HELIO_BLENDER. They are left out where it cannot be run")
      ->capture_default_str();
  app.add_option("--daemon", options.daemon, "heliographd to measure")->capture_default_str();
  std::string chosen;
  for (const Subcommand& subcommand : kSubcommands) {
    CLI::App* command = app.add_subcommand(subcommand.name, subcommand.help);
    command->callback([&chosen, name = subcommand.name] { chosen = name; });
    if (subcommand.of_scenes) add_scene_options(*command, options);
    if (std::string(subcommand.name) == "reuse") add_reuse_options(*command, options);
    if (std::string(subcommand.name) == "vulkan")
      command->add_option("--device", options.vulkan_device,
                          "Number of the Vulkan device; by default the first that can trace paths")
          ->check(CLI::Range(0, 255));
    if (std::string(subcommand.name) == "denoisers")
      command->add_option("--oidn-library", options.oidn_library,
                          "Open Image Denoise 2.x, a path or a name for the dynamic linker; also HELIOGRAPH_OIDN. Its "
                          "figures are left out without it");
    if (std::string(subcommand.name) == "previews" || std::string(subcommand.name) == "foveated")
      command->add_option("--output", options.output,
                          "Folder for PNGs of previews, beside what they are compared with");
  }
  for (const ComparisonSubcommand& subcommand : kComparisons) {
    CLI::App* command = app.add_subcommand(subcommand.name, subcommand.help);
    command->callback([&chosen, name = subcommand.name] { chosen = name; });
    add_scene_options(*command, options);
    command->add_option("--output", options.output,
                        "Folder that gets, for each comparison, a folder with comparison.json, units.csv, points.csv, "
                        "ratios.csv and report.html");
    if (std::string(subcommand.name) == "peers") add_peer_options(*command, options);
    if (std::string(subcommand.name) == "turns") add_turn_options(*command, options);
  }
  app.add_subcommand("all",
                     "all that give figures but adaptive, denoisers, display, drag, foveated, lamps, previews, python, "
                     "reuse, tev, viewer and vulkan")
      ->callback([&] { chosen = "all"; });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (options.motions.size() > 1 && std::ranges::find(options.motions, "all") != options.motions.end()) {
    note("--motions: all stands alone");
    return 2;
  }
  spdlog::set_level(spdlog::level::err);
#if !defined(__OPTIMIZE__)
  note("not an optimised build: these figures mean nothing");
#endif
  for (const ComparisonSubcommand& subcommand : kComparisons) {
    if (chosen == subcommand.name && !options.real) return run_comparison(options, subcommand, as_json);
  }
  return run(options, chosen_subcommands(options, chosen), as_json);
}
