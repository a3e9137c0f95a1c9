#include "renderer/trace/mixed_pixels.h"

#include <cmath>
#include <limits>

#include "renderer/film/film_history.h"
#include "renderer/film/packed_values.h"
#include "renderer/trace/centre_hits.h"
#include "renderer/trace/path_group.h"

namespace helio {

MixedPixels::MixedPixels(const WindowTask& task) : scene_(task.scene), film_(task.film), window_(task.window) {
  const FilmHistory* history = task.film.history();
  if (!history || !history->has_centres()) return;
  bool any = false;
  centres_.resize(std::size_t(window_.area()));
  auto to = centres_.begin();
  for (int y = window_.y0; y < window_.y1; ++y) {
    for (int x = window_.x0; x < window_.x1; ++x, ++to) {
      const CentreHit& centre = history->centre(x, y);
      // What is on a border is neither given nor taken, whatever else it shows.
      if (!centre.known() || centre.border || history->carried(x, y).mixed()) continue;
      to->asked = any = true;
      to->instance = centre.instance;
      if (!centre.hit()) continue;
      const CameraRay ray = task.camera.generate_ray(x, y, V2f(0.5f, 0.5f), V2f(0.5f, 0.5f));
      const float distance = centre.depth / dot(ray.direction, task.camera.forward());
      RayCone cone = task.camera.cone();
      cone.advance(distance);
      to->origin = ray.origin;
      to->offset = ray.direction * distance;
      to->normal = unpack_direction(centre.normal);
      to->step = cone.footprint(1);
    }
  }
  if (!any) centres_.clear();
}

bool MixedPixels::differs(const SceneData& scene, const Centre& centre, const Ray& ray, const Hit& hit) {
  constexpr std::uint32_t kNothing = CentreHit().instance;
  if (!hit.valid()) return centre.instance != kNothing;
  if (scene.instance_name(hit) != centre.instance) return true;
  const Surface surface = make_surface<true>(scene, ray, hit);
  const V3f normal = surface.front ? surface.geometric_normal : -surface.geometric_normal;
  if (!(dot(normal, centre.normal) > kOneSurface)) return true;
  const V3f apart = (ray.origin - centre.origin) + (ray.direction * hit.t - centre.offset);
  return std::fabs(dot(apart, centre.normal)) > centre.step && std::fabs(dot(apart, normal)) > centre.step;
}

void MixedPixels::look(const PathGroup& group) {
  if (centres_.empty()) return;
  for (int i = 0; i < group.count; ++i) {
    const int x = group.pixel_x[i], y = group.pixel_y[i];
    if (!window_.contains(x, y)) continue;
    Centre& centre = centres_[std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0)];
    if (!centre.asked || centre.mixed || !differs(scene_, centre, group.rays[i], group.hits[i])) continue;
    // Alone, for rays that are traced together influence each other in the last bit.
    Ray ray = group.rays[i];
    ray.t_max = std::numeric_limits<float>::infinity();
    ray.alpha_key = kCentreAlphaKey;
    const std::uint32_t first = 0;
    Hit hit;
    scene_.accel->intersect(&ray, &first, 1, &hit, RayOrder::camera);
    centre.mixed = differs(scene_, centre, ray, hit);
  }
}

void MixedPixels::commit() {
  if (centres_.empty()) return;
  auto from = centres_.begin();
  for (int y = window_.y0; y < window_.y1; ++y) {
    for (int x = window_.x0; x < window_.x1; ++x, ++from) {
      if (from->mixed) film_.history()->carried(x, y).note_mixed();
    }
  }
}

}  // namespace helio
