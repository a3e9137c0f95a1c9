// Error against time and samples of every mode, beside Mitsuba on the same XML file.
#include <algorithm>
#include <memory>
#include <utility>

#include "tests/bench/commands/contenders.h"
#include "tests/bench/peers/mitsuba_peer.h"
#include "tests/bench/render_modes.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

// A reference of our own has so many times the samples of a curve's last point, so that it adds little to its error.
constexpr std::uint32_t kReferenceFactor = 64;

// Ours, in every mode. The engine and the scene outlive them.
std::vector<Contender> our_contenders(RenderEngine& engine, const ErrorScene& scene) {
  std::vector<Contender> contenders;
  for (const ComparedMode& mode : kRenderModes) {
    RenderSettings settings = scene.settings;
    mode.choose_in(settings);
    contenders.push_back({{mode.name, settings}, [&engine, &scene, settings](int samples, std::uint64_t seed) mutable {
                            settings.seed = seed;
                            return render_picture(engine, scene.scene, settings, std::uint32_t(samples));
                          }});
  }
  return contenders;
}

// The scenes asked for, or those of the defaults that are there.
Result<std::vector<std::filesystem::path>> chosen_scenes(const BenchOptions& options) {
  static const std::vector<std::string> defaults = {"cornell", "covered", "glass"};
  std::vector<std::filesystem::path> files;
  for (const std::string& name : options.scenes.empty() ? defaults : options.scenes) {
    auto file = find_error_scene(options, name, SceneKind::mitsuba_xml);
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

Result<Contender> mitsuba_contender(MitsubaPeer& peer, const ErrorScene& scene, const std::filesystem::path& file,
                                    const std::string& picture_file) {
  if (const Status loaded = peer.load(scene.name, file.string()); !loaded) return loaded.error();
  if (const Status sized = peer.resize(scene.name, scene.reference.width, scene.reference.height); !sized)
    return sized.error();
  std::string name = "mitsuba-" + peer.version();
  std::replace(name.begin(), name.end(), ' ', '-');
  return Contender{{name, {}}, [&peer, &scene, picture_file](int samples, std::uint64_t seed) {
                     return peer.render_picture(scene.name, samples, int(seed), picture_file);
                   }};
}

}  // namespace

Result<std::vector<pb::CompareRecord>> run_peers(BenchContext& context) {
  const BenchOptions& options = context.options();
  const auto files = chosen_scenes(options);
  if (!files) return files.error();
  auto started = MitsubaPeer::start(options.mitsuba_python, options.threads);
  if (!started) note(started.error().to_string());
  const std::unique_ptr<MitsubaPeer> peer = started ? std::move(started).value() : nullptr;
  const std::string picture_file = (context.folder() / "mitsuba.exr").string();
  RenderEngine engine(options.threads);
  std::vector<pb::CompareRecord> records;
  for (const std::filesystem::path& file : *files) {
    const auto scene = load_error_scene(options, file, engine, kReferenceFactor * std::uint32_t(options.samples));
    if (!scene) return scene.error();
    std::vector<Contender> contenders = our_contenders(engine, *scene);
    if (peer) {
      auto contender = mitsuba_contender(*peer, *scene, file, picture_file);
      if (!contender) return contender.error();
      contenders.push_back(std::move(*contender));
    }
    auto record = measure_contenders(*scene, contenders, doubling_counts(options.samples), options);
    if (!record) return record.error();
    records.push_back(std::move(*record));
  }
  return records;
}

}  // namespace helio::bench
