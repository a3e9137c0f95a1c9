// Real scenes as glTF, by default settings, beside Cycles.
#include <cmath>

#include "tests/bench/commands/real.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/reference_pictures.h"

namespace helio::bench {

namespace {

// Each render of Cycles pays for synchronising the scene and for a BVH, which are no part of a sample: from the
// difference to a picture of one sample.
Result<double> seconds_per_sample(CyclesPeer& peer, int seed, const std::string& picture_file) {
  const auto start_up = peer.render_seconds(1, seed);
  if (!start_up) return start_up.error();
  const auto seconds = peer.render_seconds(1 + kRealSamples, seed, picture_file);
  if (!seconds) return seconds.error();
  return (*seconds - *start_up) / kRealSamples;
}

}  // namespace

Status measure_gltf(const BenchContext& context, const RealScene& scene,
                    const std::shared_ptr<const RenderScene>& loaded, RenderEngine& engine, CyclesPeer* peer,
                    Figures& figures) {
  const std::string picture_file = (context.folder() / "cycles.exr").string();
  if (peer) {
    const Status imported = peer->import_glb(scene.file.string(), scene.width, scene.height);
    if (!imported) return imported;
    note(scene.name + ": beside Cycles " + peer->version());
  }
  RenderSettings settings;  // the roulette of each: what it costs and what it saves is part of the figure
  settings.width = scene.width;
  settings.height = scene.height;
  std::vector<double> ours, theirs, rays, mean_ratio;
  for (int i = -1; i < context.options().repeat; ++i) {
    settings.seed = std::uint64_t(i + 1);
    const auto picture = render_picture(engine, loaded, settings, kRealSamples);
    if (!picture) return picture.error();
    if (i >= 0) {
      ours.push_back(picture->seconds / kRealSamples);
      rays.push_back(double(picture->end.progress.trace.rays) / picture->seconds * 1e-6);
    }
    if (!peer) continue;
    const auto seconds = seconds_per_sample(*peer, i + 1, picture_file);
    if (!seconds) return seconds.error();
    const auto peer_picture = read_picture(picture_file);
    if (!peer_picture) return peer_picture.error();
    if (i < 0) continue;  // warm-up
    theirs.push_back(*seconds);
    mean_ratio.push_back(mean_of(*picture) / mean_of(*peer_picture));
  }
  const std::string name = scene.name + ".gltf";
  add_beside({name + ".seconds_per_sample", "cycles", "s", ours, theirs, 0.35}, figures);
  figures.add({name + ".rays_per_second", median(rays), "Mrays/s", std::nullopt, Better::higher});
  if (peer) figures.add({name + ".mean_over_cycles", median(mean_ratio), "x", std::nullopt});
  return ok_status();
}

}  // namespace helio::bench
