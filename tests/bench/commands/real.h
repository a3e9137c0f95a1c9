// Real scenes beside other renderers: what the measurements of `peers --real` share.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/bench_context.h"
#include "tests/bench/peers/cycles_peer.h"
#include "tests/bench/peers/mitsuba_peer.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

inline constexpr int kRealSamples = 16;  // per pixel of a picture that is timed

struct RealScene {
  std::string name;  // of the scene's figures
  std::filesystem::path file;
  int width = 0, height = 0;  // of its pictures, in pixels
  std::string sky;            // of its twin (TwinRequest)
};

// NAME, NAME.over_PEER with its goal, and NAME.PEER: medians of measurements that took turns.
struct Beside {
  std::string name, peer, unit;
  std::vector<double> ours, theirs;
  std::optional<double> goal;  // of ours over theirs, at most
};
void add_beside(const Beside& beside, Figures& figures);

// Ours on the scene's Mitsuba XML twin beside Mitsuba: seconds a sample and error x time of `path`, error x time of
// `pt+bdpt`. Ratios are left out, with a note, where segments a path differ by more than 2 % or the means of the
// pictures by more than 0.5 %.
Status measure_twin(const BenchContext& context, const RealScene& scene, RenderEngine& engine, MitsubaPeer& peer,
                    Figures& figures);

// Ours on the glTF file with the default settings beside Cycles, or alone where that is null: seconds a sample, and our
// rays a second.
Status measure_gltf(const BenchContext& context, const RealScene& scene,
                    const std::shared_ptr<const RenderScene>& loaded, RenderEngine& engine, CyclesPeer* peer,
                    Figures& figures);

}  // namespace helio::bench
