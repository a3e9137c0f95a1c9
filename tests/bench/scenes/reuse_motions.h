// Camera motions that `helio_bench reuse` measures: what happens before the last view, which is the scene's own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/trace/camera/camera.h"

namespace helio::bench {

// As issue and README state them; none: for information.
struct ReuseGoals {
  std::optional<double> median_gain, worst_gain;  // over scenes, of the restart's time over ours
  std::optional<double> over_paper;               // of our gain over the better published variant's
  std::optional<double> share_of_ceiling;         // per cent
};

struct EarlierView {
  CameraPose pose;
  std::uint32_t samples = 0;  // a pixel
};

struct ReuseMotion {
  std::string name;
  std::vector<EarlierView> before;  // never empty
  ReuseGoals goals;
};

// turn-N: a rest of 256 samples N degrees aside. path-N: turns of 100 degrees by steps of N with 64 samples each (N: 5,
// 10, 20, 50). translate, jump: a rest, then one move. orbit, zoom: 64 samples a step. out-and-back, tiny-moves: a rest
// at the last view, then 64 samples a step, or one. NAME@SAMPLES: of motions of several steps but tiny-moves, so many a
// step.
const std::vector<std::string>& reuse_motion_names();
// Those of the table of goals.
const std::vector<std::string>& default_reuse_motions();

// In a scene whose depth (scene_depth.h) is `depth` > 0. invalid_argument lists the names.
Result<ReuseMotion> reuse_motion(const std::string& text, const CameraPose& home, double depth);

}  // namespace helio::bench
