#include "client/camera_motion.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <numbers>

#include "renderer/base/camera_limits.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr double kParallel = 1e-9;  // squared sine below which two directions count as parallel

V3d to_v3d(const pb::Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

void assign(pb::Vec3& to, const V3d& from) {
  to.set_x(from.x);
  to.set_y(from.y);
  to.set_z(from.z);
}

Error bad(const char* where, const char* message) {
  return {ErrorCode::invalid_argument, message, where};
}

// Rodrigues' formula; axis is unit.
V3d rotated(const V3d& v, const V3d& axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
}

V3d vertical(const CameraFrame& frame) {
  const V3d y(0, 1, 0);
  return length_squared(cross(frame.forward, y)) > kParallel ? y : frame.up;
}

Result<CameraFrame> held(const V3d& position, const V3d& forward, const V3d& up) {
  if (!in_coordinate_range(position)) return bad("position", "has a coordinate that is not in [-1e12, 1e12]");
  const double length = std::sqrt(length_squared(forward));
  if (!std::isfinite(length) || length == 0)
    return bad("look_at.target", "must be finite and differ from the position");
  const V3d along = forward / length;
  const V3d across = up - along * dot(along, up);
  if (!is_finite(up) || length_squared(up) == 0 || length_squared(across) <= kParallel * length_squared(up)) {
    return bad("look_at.up", "must be finite and not parallel to the view direction");
  }
  return CameraFrame{position, along, normalize(across)};
}

}  // namespace

Result<CameraFrame> camera_frame(const pb::CameraView& view) {
  if (view.has_scene_camera()) return bad("scene_camera", "is a name, not a place");
  if (!view.has_position()) return bad("position", "is missing");
  const V3d position = to_v3d(view.position());
  if (view.has_look_at()) {
    const V3d up = view.look_at().has_up() ? to_v3d(view.look_at().up()) : V3d(0, 1, 0);
    return held(position, to_v3d(view.look_at().target()) - position, up);
  }
  if (!view.has_rotation()) return held(position, V3d(0, 0, -1), V3d(0, 1, 0));
  const pb::CameraView::Quaternion& q = view.rotation();
  const V3d back(2 * (q.x() * q.z() + q.w() * q.y()), 2 * (q.y() * q.z() - q.w() * q.x()),
                 1 - 2 * (q.x() * q.x() + q.y() * q.y()));
  const V3d up(2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
               2 * (q.y() * q.z() + q.w() * q.x()));
  return held(position, -back, up);
}

pb::CameraView with_frame(pb::CameraView view, const CameraFrame& frame) {
  assign(*view.mutable_position(), frame.position);
  assign(*view.mutable_look_at()->mutable_target(), frame.position + frame.forward);
  assign(*view.mutable_look_at()->mutable_up(), frame.up);
  return view;
}

CameraFrame turned(const CameraFrame& frame, double degrees) {
  const V3d axis = vertical(frame);
  return {frame.position, rotated(frame.forward, axis, degrees), rotated(frame.up, axis, degrees)};
}

CameraFrame orbited(const CameraFrame& frame, const V3d& pivot, double degrees) {
  CameraFrame result = turned(frame, degrees);
  result.position = pivot + rotated(frame.position - pivot, vertical(frame), degrees);
  return result;
}

CameraFrame moved(const CameraFrame& frame, const V3d& offset) {
  const V3d right = cross(frame.forward, frame.up);
  return {frame.position + right * offset.x + frame.up * offset.y + frame.forward * offset.z, frame.forward, frame.up};
}

Result<CameraFrame> within_range(const CameraFrame& frame) {
  const V3d& p = frame.position;
  if (in_coordinate_range(p) && in_coordinate_range(p + frame.forward)) return frame;
  return Error{
      ErrorCode::invalid_argument,
      fmt::format("the camera comes to ({}, {}, {}); allowed: coordinates in {}", p.x, p.y, p.z, kCoordinateRange),
      "position"};
}

}  // namespace helio
