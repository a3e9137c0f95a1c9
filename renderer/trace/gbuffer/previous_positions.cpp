#include "renderer/trace/gbuffer/previous_positions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {
namespace {

constexpr double kDepthTolerance = 0.01;

std::vector<CentreHit> centre_hits(const RenderScene& scene, const CameraPose& pose, int width, int height) {
  const Camera camera(pose, width, height, scene.origin());
  PrimaryHits hits(scene, camera, pose.forward);
  std::vector<CentreHit> all(std::size_t(width) * std::size_t(height));
  for (int y0 = 0; y0 < height; y0 += kPathGroupSize) {
    for (int x0 = 0; x0 < width; x0 += kPathGroupSize) {
      const PixelRect window{x0, y0, std::min(x0 + kPathGroupSize, width), std::min(y0 + kPathGroupSize, height)};
      hits.trace(window);
      for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x)
          all[std::size_t(y) * std::size_t(width) + std::size_t(x)] = hits.at(x, y);
      }
    }
  }
  return all;
}

}  // namespace

FilmPositions previous_positions(const RenderScene& scene, const CameraPose& before, const CameraPose& now, int width,
                                 int height) {
  const std::vector<CentreHit> old_hits = centre_hits(scene, before, width, height);
  const std::vector<CentreHit> new_hits = centre_hits(scene, now, width, height);
  const CameraProjection from(before, width, height, scene.origin()), to(now, width, height, scene.origin());
  constexpr float kNotSeen = std::numeric_limits<float>::quiet_NaN();
  FilmPositions positions{std::vector<float>(new_hits.size(), kNotSeen), std::vector<float>(new_hits.size(), kNotSeen)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
      const CentreHit& hit = new_hits[i];
      const V3d position = to.position_at(x + 0.5, y + 0.5, hit.depth);
      const FilmPoint seen = hit.hit() ? from.point(position) : from.direction(to.direction_at(x + 0.5, y + 0.5));
      if (!seen.in_front || !(seen.x >= 0 && seen.y >= 0 && seen.x < width && seen.y < height)) continue;
      const CentreHit& old = old_hits[std::size_t(seen.y) * std::size_t(width) + std::size_t(seen.x)];
      if (!same_surface(old, hit)) continue;
      if (hit.hit()) {
        const double depth = dot(position - from.origin(), V3d(before.forward));
        const double slack = std::max(seen.footprint, kDepthTolerance * std::fabs(depth));
        if (std::fabs(old.depth - depth) > slack) continue;
      }
      positions.x[i] = float(seen.x);
      positions.y[i] = float(seen.y);
    }
  }
  return positions;
}

}  // namespace helio
