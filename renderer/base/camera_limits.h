// Ranges of what describes a camera, in scene units and radians: what files, messages and flags may say.
//
// Rays are traced in float by a library that refuses coordinates above 1.8e18 and multiplies three of them. Within
// these bounds a position is at most 2e12 from the origin of the rebased scene, and the corner of the widest
// orthographic film (65536 : 1) 7e16 from the camera.
#pragma once

#include "renderer/base/math.h"

namespace helio {

inline constexpr double kMaxCoordinate = 1e12;               // magnitude; of positions, targets and placed geometry
inline constexpr double kMinFov = 0.0017, kMaxFov = 3.1242;  // full angle: 0.1 and 179 degrees
inline constexpr double kMinCameraLength = 1e-12, kMaxCameraLength = 1e12;  // half height, focus distance
inline constexpr double kMaxLensRadius = 1e12;                              // from 0
inline constexpr double kMinAspect = 1e-6, kMaxAspect = 1e6;                // width / height

// The same, as messages give them.
inline constexpr const char* kCoordinateRange = "[-1e12, 1e12]";
inline constexpr const char* kFovRange = "[0.0017, 3.1242] radians";
inline constexpr const char* kCameraLengthRange = "[1e-12, 1e12]";
inline constexpr const char* kLensRadiusRange = "[0, 1e12]";
inline constexpr const char* kAspectRange = "[1e-6, 1e6], or 0 for none";

// False for NaN too.
inline bool in_coordinate_range(const V3d& p) {
  return std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate && std::abs(p.z) <= kMaxCoordinate;
}
inline bool in_fov_range(double radians) {
  return radians >= kMinFov && radians <= kMaxFov;
}
inline bool in_camera_length_range(double length) {
  return length >= kMinCameraLength && length <= kMaxCameraLength;
}
inline bool in_lens_radius_range(double radius) {
  return radius >= 0 && radius <= kMaxLensRadius;
}
inline bool in_aspect_range(double aspect) {
  return aspect >= kMinAspect && aspect <= kMaxAspect;
}

}  // namespace helio
