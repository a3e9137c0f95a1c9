#include "renderer/trace/gbuffer/partial_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/paths/path_group.h"

namespace helio {

PartialCoverage::PartialCoverage(const WindowTask& task)
    : scene_(task.scene), film_(task.film), half_(task.range.half), window_(task.window) {
  const FilmHistory* history = task.film.history();
  if (task.trace || !history || !history->has_centres()) return;
  bool any = false;
  centres_.resize(std::size_t(window_.area()));
  auto to = centres_.begin();
  for (int y = window_.y0; y < window_.y1; ++y) {
    for (int x = window_.x0; x < window_.x1; ++x, ++to) {
      const CentreHit& centre = history->centre(x, y);
      const CarriedPixel& carried = history->carried(x, y);
      // What is on a border is neither given nor taken, whatever else it shows.
      if (!centre.known() || centre.border) continue;
      if (carried.mixed() && !(carried.looked_up() && carried.count[half_] > 0)) continue;
      to->asked = any = true;
      to->instance = centre.instance;
      if (!centre.hit()) continue;
      const CameraRay ray = task.camera.centre_ray(x, y);
      to->origin = ray.origin;
      to->direction = ray.direction;
      to->distance = centre.depth / dot(ray.direction, task.camera.forward());
      to->normal = unpack_direction(centre.normal);
      RayCone cone = task.camera.cone();
      cone.advance(to->distance);
      to->step = cone.footprint(1);
    }
  }
  if (!any) centres_.clear();
}

bool PartialCoverage::differs(const SceneData& scene, const Centre& centre, const Ray& ray, const Hit& hit) {
  constexpr std::uint32_t kNothing = CentreHit().instance;
  if (!hit.valid()) return centre.instance != kNothing;
  if (scene.instance_name(hit) != centre.instance) return true;
  const V3f beside = (ray.origin - centre.origin) + (ray.direction - centre.direction) * centre.distance;
  const V3f apart = beside + ray.direction * (hit.t - centre.distance);
  // As many pixels' sides as the two are apart on the film, at least one.
  const float most = std::max(centre.step, length(beside)), step = std::fabs(dot(apart, centre.normal));
  if (hit.instance == kNoHit && step <= most) {
    // Nearly all: of a flat triangle, as it is not normalised; of one whose squares are floats.
    const float along = std::copysign(1.0f, -dot(hit.normal, ray.direction)) * dot(hit.normal, centre.normal);
    const float square = dot(hit.normal, hit.normal);
    if (square > 1e-30f && square < 1e30f && scene.flat[hit.part].mesh && along > 0 &&
        along * along > sqr(kOneSurface) * square) {
      return false;
    }
  }
  const Surface surface = make_surface<true>(scene, ray, hit);
  const V3f normal = surface.facing_normal();
  if (!(dot(normal, centre.normal) > kOneSurface)) return true;
  return step > most && std::fabs(dot(apart, normal)) > most;
}

void PartialCoverage::look(const PathGroup& group, std::uint32_t sample) {
  if (!any()) return;
  for (int i = 0; i < group.count; ++i) {
    const int x = group.pixel_x[i], y = group.pixel_y[i];
    if (!window_.contains(x, y)) continue;
    Centre& centre = centres_[std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0)];
    if (!centre.asked || centre.first != kNone || !differs(scene_, centre, group.rays[i], group.hits[i])) continue;
    // Alone, for rays that are traced together influence each other in the last bit.
    Ray ray = group.rays[i];
    ray.t_max = std::numeric_limits<float>::infinity();
    ray.alpha_key = kCentreAlphaKey;
    const std::uint32_t only = 0;
    Hit hit;
    scene_.accel->intersect(&ray, &only, 1, &hit, RayOrder::camera);
    ++rays_;
    if (differs(scene_, centre, ray, hit)) centre.first = sample;
  }
}

std::uint64_t PartialCoverage::tell(int x, int y, std::uint32_t sample) {
  FilmHistory& history = *film_.history();
  CarriedPixel& carried = history.carried(x, y);
  carried.note_mixed();
  if (!carried.looked_up()) return 0;
  std::uint64_t dropped = 0;
  for (int h = 0; h < kHalves; ++h) {
    const bool alone = film_.half(h, x, y).count == carried.count[h];
    if (carried.count[h] == 0 || !(h == half_ || (sample == 0 && alone))) continue;
    dropped += carried.count[h];
    history.drop(h, x, y, film_.half(h, x, y));
  }
  return dropped;
}

}  // namespace helio
