// Measures how often rays pass between the triangles of a scene.
#pragma once

#include <cstdint>

#include "renderer/trace/scene/scene_data.h"

namespace helio {

struct LeakEstimate {
  std::uint64_t aimed = 0;   // rays that cross a triangle close to one of its sides
  std::uint64_t leaked = 0;  // of these, those that were told of nothing there
  // Upper limit, at 95 %, of the share of a picture's rays that leak; 1 where too few were aimed.
  double rate_limit = 1;
};

// The most that a scene may be seen to leak. What the limit comes to is set by the number of probes, not by leaks:
// rates measured with 1e6 probes lie a hundred times below it.
inline constexpr double kMaxLeakRate = 1e-7;

// Walks from the scene's cameras and from outside, as paths do, and aims a second ray of each at the rim of the
// triangle that the first has hit, a band in which all leaks lie; whether it truly crosses the triangle is settled in
// double precision. A leak counts with the chance of an ordinary ray to hit that band (band times perimeter over area).
// Deterministic. `threads`: 0 for all.
// Preconditions: scene.accel and scene.flat are complete; no instances.
LeakEstimate estimate_leaks(const SceneData& scene, int threads);

}  // namespace helio
