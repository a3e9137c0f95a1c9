#include "tests/bench/scenes/scene_depth.h"

#include <cmath>

#include "renderer/film/core/film.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio::bench {

Result<double> scene_depth(const RenderScene& scene, const CameraPose& view) {
  constexpr int kSize = 64;
  Film film(kSize, kSize);
  PathSettings settings;
  settings.max_segments = 1;
  TraceStats stats;
  trace_window(scene, Camera(view, kSize, kSize, scene.origin()), settings, {0, 0, 1}, film.bounds(), CancelToken(),
               film, stats);
  double sum = 0;
  int hits = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float depth = film.features(x, y).depth;
      if (!std::isfinite(depth) || film.features(x, y).hits == 0) continue;
      sum += depth;
      ++hits;
    }
  }
  if (hits == 0)
    return Error{ErrorCode::failed_precondition, "no ray of the view meets a surface", scene.description().name};
  return sum / hits;
}

}  // namespace helio::bench
