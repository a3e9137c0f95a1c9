#include "renderer/trace/camera/camera_importance.h"

#include <cmath>

#include "renderer/trace/sampling/pixel_filter_sampling.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

CameraImportance::CameraImportance(const Camera& camera)
    : orthographic_(camera.orthographic_),
      width_(camera.width_),
      height_(camera.height_),
      step_(length(camera.step_x_)),
      lens_radius_(camera.lens_radius_),
      focus_distance_(camera.focus_distance_),
      origin_(camera.origin_),
      forward_(camera.forward_),
      right_(camera.step_x_ / step_),
      down_(camera.step_y_ / step_),
      filter_(camera.filter_) {}

double CameraImportance::density(const V3f& direction) const {
  const double cosine = dot(V3d(direction), forward_);
  if (!(cosine > 0)) return 0;
  // A pixel is step^2 on the plane at distance 1: solid angle step^2 cos^3. Orthographic: step^2 across the view axis.
  return 1 / (step_ * step_ * (orthographic_ ? cosine : cosine * cosine * cosine));
}

CameraConnection CameraImportance::connect(const V3f& point, const V2f& lens) const {
  CameraConnection c;
  const V2f disk = lens_radius_ > 0 ? square_to_disk(lens) : V2f(0, 0);
  const V3d on_lens = right_ * (double(disk.x) * lens_radius_) - down_ * (double(disk.y) * lens_radius_);
  V3d to_point = V3d(point) - origin_ - on_lens;  // perspective: from the lens's sampled point
  V3d film;                                       // of the plane through the film: across at distance 1, or across
  if (orthographic_) {
    const V3d along = (forward_ * focus_distance_ - on_lens).normalized();
    const double distance = dot(to_point, forward_) / dot(along, forward_);
    if (!(distance > 0)) return c;
    film = to_point - along * distance;
    to_point = along * distance;
  } else {
    const double depth = dot(to_point, forward_);
    if (!(depth > 0)) return c;
    // Through the plane in focus, where rays from all of the lens meet.
    film = to_point * (1 / depth) + on_lens * (1 / focus_distance_);
  }
  c.film_x = dot(film, right_) / step_ + 0.5 * width_;
  c.film_y = dot(film, down_) / step_ + 0.5 * height_;
  if (!(c.film_x >= 0 && c.film_x < width_ && c.film_y >= 0 && c.film_y < height_)) return c;
  const double distance = length(to_point);
  c.distance = float(distance);
  c.direction = V3f(to_point * (-1 / distance));
  c.density = density(-c.direction);
  return c;
}

CameraImportance::Reach CameraImportance::reach(double at, int size) const {
  const double radius = pixel_filter_radius(filter_);
  return {std::max(0, int(std::floor(at - radius - 0.5))), std::min(size - 1, int(std::ceil(at + radius - 0.5)))};
}

double CameraImportance::share(double at, int pixel, int size) const {
  const double centre = pixel + 0.5;
  return pixel_filter_density(filter_, at - centre, -centre, size - centre);
}

}  // namespace helio
