// Real scenes beside Mitsuba, beside Cycles, and beside bare Embree.
#include "tests/bench/commands/real.h"

#include <algorithm>

#include "tests/bench/commands/ray_share.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace fs = std::filesystem;

namespace {

constexpr double kRayShareGoal = 0.5;

struct KnownScene {
  const char* name;
  const char* file;  // below shared scenes/
  const char* sky;   // of its twin
  bool with_peers;
};
const KnownScene kScenes[] = {{"sponza-dabrovic", "glb/sponza-dabrovic.glb", "1,1,1", true},
                              {"breakfast-room", "glb/breakfast-room.glb", "0.4,0.4,0.6", true},
                              {"kitchen-partial", "kitchen-partial/kitchen-partial-meshopt.glb", "", false}};

Status check_names(const std::vector<std::string>& chosen) {
  std::string known;
  for (const KnownScene& scene : kScenes) known += std::string(known.empty() ? "" : ", ") + scene.name;
  for (const std::string& name : chosen) {
    if (std::ranges::none_of(kScenes, [&](const KnownScene& scene) { return name == scene.name; }))
      return Error{ErrorCode::invalid_argument, "no scene of --real; there are " + known, name};
  }
  return ok_status();
}

// Null, and a note, where it is not there.
template <class Peer>
std::unique_ptr<Peer> unless_absent(Result<std::unique_ptr<Peer>> started) {
  if (started) return std::move(started).value();
  note(started.error().to_string());
  return nullptr;
}

}  // namespace

void add_beside(const Beside& beside, Figures& figures) {
  figures.add({beside.name, median(beside.ours), beside.unit, std::nullopt});
  if (beside.theirs.empty()) return;
  const double theirs = median(beside.theirs);
  figures.add({beside.name + ".over_" + beside.peer, median(beside.ours) / theirs, "x", beside.goal});
  figures.add({beside.name + "." + beside.peer, theirs, beside.unit, std::nullopt});
}

Status run_real(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  if (const Status known = check_names(options.scenes); !known) return known;
  const int height = options.size == BenchOptions().size ? 360 : options.size, width = height * 16 / 9;
  const auto mitsuba = unless_absent(MitsubaPeer::start(options.mitsuba_python, options.threads));
  const auto cycles = unless_absent(CyclesPeer::start_module(options.bpy_python, options.threads));
  RenderEngine engine(options.threads);
  for (const KnownScene& known : kScenes) {
    if (!options.scenes.empty() && std::ranges::find(options.scenes, known.name) == options.scenes.end()) continue;
    const RealScene scene{known.name, fs::path(options.shared) / "scenes" / known.file, width, height, known.sky};
    if (!fs::exists(scene.file)) {
      note(scene.name + " is left out: " + scene.file.string() + " is absent");
      continue;
    }
    if (known.with_peers && mitsuba) {
      if (const Status done = measure_twin(context, scene, engine, *mitsuba, figures); !done) return done;
    }
    const auto loaded = load_bench_scene(scene.file, options.threads);
    if (!loaded) return loaded.error();
    CyclesPeer* const peer = known.with_peers ? cycles.get() : nullptr;
    if (const Status done = measure_gltf(context, scene, *loaded, engine, peer, figures); !done) return done;
    if (!known.with_peers) continue;
    RayShareRequest replay{scene.name + ".replay", *loaded, width, height};
    replay.goal = kRayShareGoal;
    if (const Status done = add_ray_share(replay, engine, options, figures); !done) return done;
  }
  return ok_status();
}

}  // namespace helio::bench
