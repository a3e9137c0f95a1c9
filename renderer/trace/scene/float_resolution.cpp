#include "renderer/trace/scene/float_resolution.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>

#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/surface.h"

namespace helio {
namespace {

constexpr int kGrid = 8;
constexpr std::size_t kMaxCameras = 16;
// A hundredth of the distance is about five pixels of a picture 512 pixels high.
constexpr float kVisibleShare = 0.01f;

}  // namespace

std::vector<std::string> find_unresolved_views(const SceneData& scene) {
  std::vector<std::string> notices;
  for (std::size_t c = 0; c < std::min(scene.description.cameras.size(), kMaxCameras); ++c) {
    const CameraDescription& description = scene.description.cameras[c];
    const Camera camera(camera_pose(description), kGrid, kGrid, scene.origin);
    Ray rays[kGrid * kGrid];
    std::uint32_t order[kGrid * kGrid];
    Hit hits[kGrid * kGrid];
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const CameraRay ray = camera.generate_ray(i % kGrid, i / kGrid, V2f(0.5f, 0.5f), V2f(0.5f, 0.5f));
      rays[i].origin = ray.origin;
      rays[i].direction = ray.direction;
      rays[i].t_max = std::numeric_limits<float>::infinity();
      order[i] = std::uint32_t(i);
    }
    scene.accel->intersect(rays, order, kGrid * kGrid, hits, RayOrder::scattered);
    std::vector<std::pair<float, float>> unresolved;  // distance, offset
    int seen = 0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      if (!hits[i].valid()) continue;
      ++seen;
      const float offset = make_surface<true>(scene, rays[i], hits[i]).offset;
      if (!(offset <= kVisibleShare * hits[i].t)) unresolved.emplace_back(hits[i].t, offset);
    }
    if (seen == 0 && !scene.features.environment && !scene.world_bounds.isEmpty()) {
      notices.push_back(fmt::format("camera \"{}\" sees nothing: none of {} rays spread over its picture meets a surface, "
                                    "and there is no environment",
                                    description.name, kGrid * kGrid));
      continue;
    }
    if (2 * unresolved.size() <= std::size_t(seen)) continue;
    const auto middle = unresolved.begin() + std::ptrdiff_t(unresolved.size() / 2);
    std::nth_element(unresolved.begin(), middle, unresolved.end());
    notices.push_back(fmt::format(
        "camera \"{}\" sees surfaces {:.2g} units away in a scene {:.2g} units across: single precision resolves "
        "their surroundings to {:.2g} units only, lighting closer than that is wrong",
        description.name, middle->first, 2 * double(scene.radius), middle->second));
  }
  return notices;
}

}  // namespace helio
