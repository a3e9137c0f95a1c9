// Error against time and samples, for every mode; and beside Mitsuba on the same XML file.
#include "error_curves.h"
#include "figures.h"
#include "mitsuba_peer.h"
#include "render_modes.h"
#include "subcommands.h"

namespace helio::bench {

namespace {

// A reference of our own has so many times the samples of a curve's last point, so that it adds little to its error.
constexpr std::uint32_t kReferenceFactor = 64;

// Ours, in one mode. The engine and the scene outlive it.
Contender our_contender(RenderEngine& engine, const ErrorScene& scene, RenderMode mode) {
  return {"heliograph", to_string(mode), [&engine, &scene, mode](int samples, std::uint64_t seed) {
            RenderSettings settings;
            settings.width = scene.reference.width;
            settings.height = scene.reference.height;
            settings.mode = mode;
            settings.seed = seed;
            return render_picture(engine, scene.scene, settings, std::uint32_t(samples));
          }};
}

// The scenes asked for, or those of the defaults that are there.
Result<std::vector<std::filesystem::path>> chosen_scenes(const BenchOptions& options,
                                                         const std::vector<std::string>& defaults, SceneKind kind) {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : options.scenes.empty() ? defaults : options.scenes) {
    auto file = find_error_scene(options, name, kind);
    if (file) {
      files.push_back(*file);
    } else if (options.scenes.empty()) {
      note(file.error().to_string() + "; left out");
    } else {
      return file.error();
    }
  }
  return files;
}

}  // namespace

Result<std::vector<CurveReport>> run_modes(BenchContext& context) {
  const BenchOptions& options = context.options();
  const auto files = chosen_scenes(options, {"cornell", "covered", "glass", "cornell-glossy", "veach-plates"},
                                   SceneKind::any);
  if (!files) return files.error();
  RenderEngine engine(options.threads);
  std::vector<CurveReport> curves;
  for (const std::filesystem::path& file : *files) {
    const auto scene = load_error_scene(options, file, engine, kReferenceFactor * std::uint32_t(options.samples));
    if (!scene) return scene.error();
    std::vector<Contender> contenders;
    for (const RenderMode mode : kRenderModes) contenders.push_back(our_contender(engine, *scene, mode));
    auto measured = measure_curves(*scene, contenders, doubling_counts(options.samples), options.seeds);
    if (!measured) return measured.error();
    curves.insert(curves.end(), measured->begin(), measured->end());
  }
  return curves;
}

Result<std::vector<CurveReport>> run_peers(BenchContext& context) {
  const BenchOptions& options = context.options();
  const auto files = chosen_scenes(options, {"cornell", "covered", "glass"}, SceneKind::mitsuba_xml);
  if (!files) return files.error();
  std::unique_ptr<MitsubaPeer> peer;
  if (auto started = MitsubaPeer::start(options.mitsuba_python, options.threads); !started) {
    note(started.error().to_string());
  } else {
    peer = std::move(started).value();
  }
  RenderEngine engine(options.threads);
  std::vector<CurveReport> curves;
  for (const std::filesystem::path& file : *files) {
    const auto scene = load_error_scene(options, file, engine, kReferenceFactor * std::uint32_t(options.samples));
    if (!scene) return scene.error();
    std::vector<Contender> contenders;
    for (const RenderMode mode : kRenderModes) contenders.push_back(our_contender(engine, *scene, mode));
    if (peer) {
      const LoopPicture& reference = scene->reference;
      if (const Status loaded = peer->load(scene->name, file.string()); !loaded) return loaded.error();
      if (const Status sized = peer->resize(scene->name, reference.width, reference.height); !sized)
        return sized.error();
      const std::string picture_file = (context.folder() / "mitsuba.exr").string();
      contenders.push_back({"mitsuba " + peer->version(), "path", [&, picture_file](int samples, std::uint64_t seed) {
                              return peer->render_picture(scene->name, samples, int(seed), picture_file);
                            }});
    }
    auto measured = measure_curves(*scene, contenders, doubling_counts(options.samples), options.seeds);
    if (!measured) return measured.error();
    curves.insert(curves.end(), measured->begin(), measured->end());
  }
  return curves;
}

}  // namespace helio::bench
