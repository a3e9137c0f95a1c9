#include "renderer/trace/gbuffer/silhouette_coverage.h"

#include <limits>

#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {
namespace {

constexpr int kAround[8][2] = {{0, 0}, {1, 0}, {2, 0}, {0, 1}, {2, 1}, {0, 2}, {1, 2}, {2, 2}};

}  // namespace

SilhouetteCoverage::SilhouetteCoverage(const RenderScene& scene, const Camera& camera, const V3d& axis,
                                       const PixelRect& window, const std::vector<std::uint8_t>& asked)
    : window_(window) {
  slot_.assign(point(0, 2 * window.height() + 1), kNotTraced);
  std::vector<Ray> rays;
  std::vector<std::uint32_t> order;
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      if (!asked[i]) continue;
      for (const int (&at)[2] : kAround) {
        const int column = 2 * (x - window.x0) + at[0], row = 2 * (y - window.y0) + at[1];
        std::uint32_t& slot = slot_[point(column, row)];
        if (slot != kNotTraced) continue;
        slot = std::uint32_t(rays.size());
        const CameraRay from =
            camera.generate_ray(window.x0 + column / 2, window.y0 + row / 2,
                                V2f(0.5f * float(column % 2), 0.5f * float(row % 2)), V2f(0.5f, 0.5f));
        Ray& ray = rays.emplace_back();
        ray.origin = from.origin;
        ray.direction = from.direction;
        ray.t_max = std::numeric_limits<float>::infinity();
        ray.alpha_key = kCentreAlphaKey;
        order.push_back(slot);
      }
    }
  }
  rays_ = rays.size();
  if (rays.empty()) return;
  std::vector<Hit> hits(rays.size());
  scene.impl().accel->intersect(rays.data(), order.data(), rays.size(), hits.data(), RayOrder::camera);
  for (std::size_t k = 0; k < hits.size(); ++k) {
    CentreHit& hit = hits_.emplace_back(surface_at(scene.impl(), rays[k], hits[k]));
    if (hits[k].valid()) hit.depth = hits[k].t * dot(rays[k].direction, V3f(axis));
  }
}

bool SilhouetteCoverage::show_only(const CentreHit& centre, int x, int y, SurfaceSteps& steps) const {
  for (const int (&at)[2] : kAround) {
    const std::uint32_t slot = slot_[point(2 * (x - window_.x0) + at[0], 2 * (y - window_.y0) + at[1])];
    if (!steps.one_surface(centre, x + 0.5, y + 0.5, hits_[slot], x + 0.5 * at[0], y + 0.5 * at[1])) return false;
  }
  return true;
}

}  // namespace helio
