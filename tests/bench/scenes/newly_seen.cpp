#include "tests/bench/scenes/newly_seen.h"

#include <algorithm>
#include <cmath>

#include "renderer/film/core/film_windows.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio::bench {

namespace {

// Row-major.
std::vector<CentreHit> centres_of(const RenderScene& scene, const CameraPose& pose, int width, int height) {
  const Camera camera(pose, width, height, scene.origin());
  PrimaryHits centres(scene, camera, pose.forward);
  std::vector<CentreHit> all(std::size_t(width) * std::size_t(height));
  for (const PixelRect& block : cut_aligned({0, 0, width, height}, kPathGroupSize, kPathGroupSize)) {
    centres.trace(block);
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x)
        all[std::size_t(y) * std::size_t(width) + std::size_t(x)] = centres.at(x, y);
    }
  }
  return all;
}

}  // namespace

double newly_seen_share(const RenderScene& scene, const std::vector<CameraPose>& before, const CameraPose& view,
                        int width, int height) {
  constexpr double kDepthTolerance = 0.05;
  const std::vector<CentreHit> here = centres_of(scene, view, width, height);
  const CameraProjection now(view, width, height, scene.origin());
  std::vector<char> seen(here.size(), 0);
  for (const CameraPose& pose : before) {
    const std::vector<CentreHit> there = centres_of(scene, pose, width, height);
    const CameraProjection then(pose, width, height, scene.origin());
    std::size_t i = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x, ++i) {
        if (seen[i]) continue;
        const V3d position = here[i].hit() ? now.position_at(x + 0.5, y + 0.5, double(here[i].depth))
                                           : now.direction_at(x + 0.5, y + 0.5);
        const FilmPoint p = here[i].hit() ? then.point(position) : then.direction(position);
        if (!p.in_front || !(p.x >= 0 && p.y >= 0 && p.x < width && p.y < height)) continue;
        const CentreHit& met = there[std::size_t(p.y) * std::size_t(width) + std::size_t(p.x)];
        if (!same_surface(here[i], met)) continue;
        const double depth = dot(position - then.origin(), pose.forward);
        seen[i] = !met.hit() || std::abs(double(met.depth) - depth) <= kDepthTolerance * depth;
      }
    }
  }
  return 1 - double(std::count(seen.begin(), seen.end(), 1)) / double(seen.size());
}

}  // namespace helio::bench
