#include "renderer/trace/camera/camera_projection.h"

#include <cmath>

namespace helio {

CameraProjection::CameraProjection(const CameraPose& pose, int width, int height, const V3d& scene_origin)
    : orthographic_(pose.projection == Projection::orthographic),
      origin_(V3f(pose.position - scene_origin)),  // as Camera rounds it
      forward_(pose.forward) {
  const double half_height = orthographic_ ? pose.half_height : std::tan(0.5 * pose.vertical_fov);
  step_ = 2 * half_height / height;
  step_x_ = pose.right * step_;
  step_y_ = pose.up * -step_;
  corner_ = step_x_ * (-0.5 * width) + step_y_ * (-0.5 * height);
  if (!orthographic_) corner_ += pose.forward;
  // A pose's axes are orthonormal to 1e-3 only; the inverse is that of the axes as they are.
  const V3d third = orthographic_ ? forward_ : corner_;
  const double determinant = dot(step_x_, cross(step_y_, third));
  to_x_ = cross(step_y_, third) / determinant;
  to_y_ = cross(third, step_x_) / determinant;
  to_depth_ = cross(step_x_, step_y_) / determinant;
}

FilmPoint CameraProjection::project(const V3d& offset) const {
  FilmPoint p;
  if (orthographic_) {
    const V3d from_corner = offset - corner_;
    p.x = dot(to_x_, from_corner);
    p.y = dot(to_y_, from_corner);
    p.footprint = step_;
    p.in_front = dot(to_depth_, from_corner) > 0;
    return p;
  }
  const double depth = dot(to_depth_, offset);
  if (!(depth > 0)) return p;
  p.x = dot(to_x_, offset) / depth;
  p.y = dot(to_y_, offset) / depth;
  p.footprint = step_ * depth;
  p.in_front = std::isfinite(p.x) && std::isfinite(p.y);
  return p;
}

FilmPoint CameraProjection::point(const V3d& position) const {
  return project(position - origin_);
}

FilmPoint CameraProjection::direction(const V3d& towards) const {
  if (!orthographic_) return project(towards);
  // All rays of an orthographic camera leave in one direction: the whole film sees it, or none of it.
  return {};
}

V3d CameraProjection::direction_at(double film_x, double film_y) const {
  return orthographic_ ? forward_ : (corner_ + step_x_ * film_x + step_y_ * film_y).normalized();
}

CameraProjection::Heights CameraProjection::heights_along(const V3d& direction) const {
  Heights heights;
  heights.orthographic_ = orthographic_;
  heights.corner_ = dot(corner_, direction);
  heights.step_x_ = dot(step_x_, direction);
  heights.step_y_ = dot(step_y_, direction);
  heights.forward_ = dot(forward_, direction);
  return heights;
}

}  // namespace helio
