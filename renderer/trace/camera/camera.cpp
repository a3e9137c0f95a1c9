#include "renderer/trace/camera/camera.h"

#include <spdlog/fmt/fmt.h>

#include <string>

#include "renderer/base/camera_limits.h"
#include "renderer/trace/sampling/pixel_filter_sampling.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

V3d row(const M44d& m, int i) {
  return V3d(m[i][0], m[i][1], m[i][2]);
}

// Orthonormal axes from a forward direction and an approximate up; false when they are parallel or degenerate.
bool orient(const V3d& forward, const V3d& up, CameraPose& pose) {
  const double forward_length = length(forward), up_length = length(up);
  if (!(forward_length > 0) || !(up_length > 0) || !std::isfinite(forward_length) || !std::isfinite(up_length)) {
    return false;
  }
  pose.forward = forward / forward_length;
  const V3d right = cross(pose.forward, up / up_length);
  const double right_length = length(right);
  if (!(right_length > 1e-9)) return false;
  pose.right = right / right_length;
  pose.up = cross(pose.right, pose.forward);
  return true;
}

void check_position(const V3d& p, const std::string& where, Problems& problems) {
  if (!in_coordinate_range(p)) {
    problems.add(where, fmt::format("({}, {}, {}); allowed: finite numbers in {}", p.x, p.y, p.z, kCoordinateRange));
  }
}

void check(bool allowed, double value, const std::string& where, const char* range, Problems& problems) {
  if (!allowed) problems.add(where, fmt::format("{}; allowed: {}", value, range));
}

// Nearest value in range; `fallback` for NaN.
double into_range(double value, double low, double high, double fallback) {
  return std::isnan(value) ? fallback : std::clamp(value, low, high);
}

}  // namespace

CameraPose camera_pose(const CameraDescription& camera) {
  CameraPose pose;
  pose.projection = camera.projection;
  for (int axis = 0; axis < 3; ++axis) {
    pose.position[axis] = into_range(camera.to_world[3][axis], -kMaxCoordinate, kMaxCoordinate, 0);
  }
  // Scale and shear of the node are ignored: only the directions of the view axis and of "up" count.
  if (!orient(-row(camera.to_world, 2), row(camera.to_world, 1), pose)) {
    pose.forward = V3d(0, 0, -1);
    pose.right = V3d(1, 0, 0);
    pose.up = V3d(0, 1, 0);
  }
  pose.vertical_fov = into_range(camera.vertical_fov, kMinFov, kMaxFov, pose.vertical_fov);
  pose.half_height = into_range(camera.half_height, kMinCameraLength, kMaxCameraLength, pose.half_height);
  pose.lens_radius = into_range(camera.lens_radius, 0, kMaxLensRadius, pose.lens_radius);
  pose.focus_distance = into_range(camera.focus_distance, kMinCameraLength, kMaxCameraLength, pose.focus_distance);
  if (camera.keeps_aspect) pose.aspect = into_range(camera.aspect, kMinAspect, kMaxAspect, 0);
  return pose;
}

namespace {

// How many pixels wider or narrower the picture is than one of the pose's aspect; 0: rounding to whole pixels explains
// the difference.
double excess_width(const CameraPose& pose, int width, int height) {
  if (pose.aspect == 0) return 0;
  const double excess = width - height * pose.aspect;
  return std::abs(excess) <= 0.5 * std::max(1.0, pose.aspect) * (1 + 1e-6) ? 0 : excess;
}

}  // namespace

CameraPose fitted(CameraPose pose, int width, int height) {
  if (excess_width(pose, width, height) < 0) {
    const double factor = pose.aspect * height / width;
    pose.half_height = std::min(pose.half_height * factor, kMaxCameraLength);
    pose.vertical_fov = std::min(2 * std::atan(std::tan(0.5 * pose.vertical_fov) * factor), kMaxFov);
  }
  pose.aspect = 0;
  return pose;
}

std::string aspect_notice(const CameraPose& pose, int width, int height) {
  const double excess = excess_width(pose, width, height);
  if (excess == 0) return {};
  return fmt::format("the camera frames an aspect (width / height) of {:.4g}, the picture has {:.4g}: it shows more {}",
                     pose.aspect, double(width) / height, excess < 0 ? "above and below" : "at both sides");
}

Result<CameraPose> look_at(const V3d& position, const V3d& target, const V3d& up, double vertical_fov) {
  Problems problems;
  check_position(position, "position", problems);
  check_position(target, "target", problems);
  check_position(up, "up", problems);
  CameraPose pose;
  pose.position = position;
  pose.vertical_fov = vertical_fov;
  if (problems.empty() && length(target - position) == 0) {
    problems.add("target", "equals the position; it must differ from it");
  }
  if (problems.empty() && !orient(target - position, up, pose)) {
    problems.add("up", "must be neither zero nor parallel to the view direction");
  }
  check(in_fov_range(vertical_fov), vertical_fov, "vertical_fov", kFovRange, problems);
  if (!problems.empty()) return problems.to_error();
  return pose;
}

void validate(const CameraPose& pose, const std::string& where, Problems& problems) {
  const auto field = [&](const char* name) { return where.empty() ? std::string(name) : where + "." + name; };
  check_position(pose.position, field("position"), problems);
  const bool axes_finite = is_finite(pose.right) && is_finite(pose.up) && is_finite(pose.forward);
  const auto unit = [](const V3d& v) { return std::abs(length(v) - 1) < 1e-3; };
  if (!axes_finite || !unit(pose.right) || !unit(pose.up) || !unit(pose.forward) ||
      std::abs(dot(pose.right, pose.up)) > 1e-3 || std::abs(dot(pose.right, pose.forward)) > 1e-3 ||
      std::abs(dot(pose.up, pose.forward)) > 1e-3) {
    problems.add(field("rotation"), "axes are not orthonormal");
  }
  if (pose.projection == Projection::perspective) {
    check(in_fov_range(pose.vertical_fov), pose.vertical_fov, field("vertical_fov"), kFovRange, problems);
  } else {
    check(in_camera_length_range(pose.half_height), pose.half_height, field("half_height"), kCameraLengthRange,
          problems);
  }
  check(in_lens_radius_range(pose.lens_radius), pose.lens_radius, field("lens_radius"), kLensRadiusRange, problems);
  check(in_camera_length_range(pose.focus_distance), pose.focus_distance, field("focus_distance"), kCameraLengthRange,
        problems);
  check(pose.aspect == 0 || in_aspect_range(pose.aspect), pose.aspect, field("aspect"), kAspectRange, problems);
}

Camera::Camera(const CameraPose& pose, int width, int height, const V3d& scene_origin, const PixelFilter& filter)
    : filter_(filter), width_(width), height_(height) {
  orthographic_ = pose.projection == Projection::orthographic;
  const double half_height = orthographic_ ? pose.half_height : std::tan(0.5 * pose.vertical_fov);
  const double step = 2 * half_height / height;
  step_x_ = pose.right * step;
  step_y_ = pose.up * -step;
  corner_ = step_x_ * (-0.5 * width) + step_y_ * (-0.5 * height);
  if (!orthographic_) corner_ += pose.forward;
  (orthographic_ ? cone_.width : cone_.spread) = float(step);
  origin_ = V3f(pose.position - scene_origin);
  forward_ = V3f(pose.forward);
  right_ = V3f(pose.right);
  up_ = V3f(pose.up);
  lens_radius_ = float(pose.lens_radius);
  focus_distance_ = float(pose.focus_distance);
}

CameraRay Camera::generate_ray(int x, int y, const V2f& in_pixel, const V2f& lens) const {
  double film_x = x + double(in_pixel.x), film_y = y + double(in_pixel.y);
  if (filter_.kind != PixelFilterKind::box) {
    const double x_centre = x + 0.5, y_centre = y + 0.5;
    film_x = x_centre + sample_pixel_filter(filter_, in_pixel.x, -x_centre, width_ - x_centre);
    film_y = y_centre + sample_pixel_filter(filter_, in_pixel.y, -y_centre, height_ - y_centre);
  }
  return ray_at(film_x, film_y, lens);
}

CameraRay Camera::ray_at(double film_x, double film_y, const V2f& lens) const {
  const V3f offset(corner_ + step_x_ * film_x + step_y_ * film_y);
  CameraRay ray;
  if (orthographic_) {
    ray.origin = origin_ + offset;
    ray.direction = forward_;
  } else {
    ray.origin = origin_;
    ray.direction = offset;
  }
  if (lens_radius_ > 0) {
    // `offset` lies on the plane at distance 1 along the view axis (perspective), so scaling it by the focus distance
    // reaches the plane in focus. Relative to the lens's centre, which may be far away.
    const V3f focus = (orthographic_ ? forward_ : offset) * focus_distance_;
    const V2f disk = square_to_disk(lens);
    const V3f on_lens = right_ * (disk.x * lens_radius_) + up_ * (disk.y * lens_radius_);
    ray.origin += on_lens;
    ray.direction = focus - on_lens;
  }
  ray.direction = normalize(ray.direction);
  return ray;
}

}  // namespace helio
