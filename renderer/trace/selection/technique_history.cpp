#include "renderer/trace/selection/technique_history.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "renderer/film/core/light_tiles.h"
#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {

namespace {

// Where a tile's rays go, in shares of its side.
constexpr double kPlaces[][2] = {{0.5, 0.5}, {0.2, 0.2}, {0.8, 0.2}, {0.2, 0.8}, {0.8, 0.8}};
constexpr std::size_t kRays = std::size(kPlaces);
constexpr int kLeastSeen = 2;
// Share of the distance to a camera that a ray leaves out at either end: it is asked whether something else is between.
constexpr float kMargin = 1e-3f;

struct Sum {
  TileEstimate total;
  int seen = 0;
};

// To the camera, or to the plane that an orthographic one looks from.
Ray ray_to(const CameraProjection& camera, const V3f& from) {
  Ray ray;
  V3f back = V3f(camera.origin()) - from;
  if (camera.orthographic()) {
    const V3f forward(camera.direction_at(0, 0));
    back = forward * dot(back, forward);
  }
  const float distance = back.length();
  ray.direction = distance > 0 ? back / distance : V3f(0, 0, 1);
  ray.origin = from + ray.direction * (kMargin * distance);
  ray.t_max = distance * (1 - 2 * kMargin);
  return ray;
}

}  // namespace

void TileEstimate::add(const TileEstimate& other) {
  path.error += other.path.error;
  path.cost += other.path.cost;
  bdpt.error += other.bdpt.error;
  bdpt.cost += other.bdpt.cost;
}

TileEstimate TileEstimate::over(double n) const {
  return {{path.error / n, path.cost / n}, {bdpt.error / n, bdpt.cost / n}};
}

TechniqueHistory::Views TechniqueHistory::views(const std::shared_ptr<const RenderScene>& scene, int width,
                                                int height) const {
  if (views_.size() >= kMostViews || scene_.lock() != scene) return {};
  Views fitting;
  for (const auto& view : views_) {
    if (view->width == width && view->height == height) fitting.push_back(view);
  }
  return fitting;
}

void TechniqueHistory::note(const std::shared_ptr<const RenderScene>& scene, std::shared_ptr<const ProbedView> view,
                            bool whole) {
  if (whole || scene_.lock() != scene) views_.clear();
  scene_ = scene;
  views_.insert(views_.begin(), std::move(view));
}

std::size_t TechniqueHistory::bytes() const {
  return std::accumulate(views_.begin(), views_.end(), std::size_t(0), [](std::size_t sum, const auto& view) {
    return sum + sizeof *view + view->tiles.capacity() * sizeof view->tiles[0];
  });
}

std::vector<std::optional<TileEstimate>> recall_tiles(const RenderScene& scene, const CameraPose& pose,
                                                      const TechniqueHistory::Views& views, std::size_t first,
                                                      std::size_t count) {
  std::vector<std::optional<TileEstimate>> tiles(count);
  if (views.empty()) return tiles;
  const SceneData& data = scene.impl();
  const int width = views[0]->width, height = views[0]->height;
  const LightTiles grid(width, height, false);
  const Camera camera(pose, width, height, scene.origin());

  std::vector<Ray> rays(count * kRays);
  std::vector<std::uint32_t> order(rays.size());
  std::iota(order.begin(), order.end(), 0u);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const PixelRect tile = grid.window(first + i / kRays);
    const double* place = kPlaces[i % kRays];
    const CameraRay from =
        camera.generate_ray(tile.x0 + int(place[0] * tile.width()), tile.y0 + int(place[1] * tile.height()),
                            V2f(0.5f, 0.5f), V2f(0.5f, 0.5f));
    rays[i].origin = from.origin;
    rays[i].direction = from.direction;
    rays[i].t_max = std::numeric_limits<float>::infinity();
  }
  std::vector<Hit> hits(rays.size());
  data.accel->intersect(rays.data(), order.data(), rays.size(), hits.data(), RayOrder::camera);

  // The side of the surface that is seen.
  const auto facing = [&](std::size_t i, const V3f& direction) {
    const Hit& hit = hits[i];
    const V3f normal = hit.instance == kNoHit ? hit.normal : data.instances[hit.instance].normal(hit.normal);
    return dot(normal, direction) > 0;
  };
  std::vector<Sum> sums(count);
  std::vector<bool> found(rays.size(), false);
  std::vector<Ray> back;
  std::vector<std::pair<std::size_t, const TileEstimate*>> asked;  // a ray, and what is known if it is not occluded
  std::vector<std::uint8_t> occluded;
  for (const auto& view : views) {
    const CameraProjection then(view->pose, width, height, scene.origin());
    back.clear();
    asked.clear();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (found[i]) continue;
      const V3f met = hits[i].valid() ? rays[i].origin + rays[i].direction * hits[i].t : rays[i].direction;
      const FilmPoint p = hits[i].valid() ? then.point(V3d(met)) : then.direction(V3d(met));
      if (!p.in_front || !(p.x >= 0 && p.y >= 0 && p.x < width && p.y < height)) continue;
      const std::optional<TileEstimate>& known = view->tiles[grid.at(int(p.x), int(p.y))];
      if (!known) continue;
      if (hits[i].valid()) {
        const Ray ray = ray_to(then, met);
        if (facing(i, ray.direction) == facing(i, rays[i].direction)) continue;
        back.push_back(ray);
      }
      asked.emplace_back(i, &*known);
    }
    occluded.assign(back.size(), 0);
    data.accel->occluded(back.data(), back.size(), occluded.data());
    std::size_t next = 0;
    for (const auto& [i, known] : asked) {
      if (hits[i].valid() && occluded[next++]) continue;
      found[i] = true;
      sums[i / kRays].total.add(*known);
      ++sums[i / kRays].seen;
    }
  }
  for (std::size_t t = 0; t < count; ++t) {
    if (sums[t].seen >= kLeastSeen) tiles[t] = sums[t].total.over(sums[t].seen);
  }
  return tiles;
}

}  // namespace helio
