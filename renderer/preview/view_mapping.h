// From a pixel of one view and its depth to the film of another: a linear map of homogeneous coordinates, worked out in
// double for two cameras and applied in float.
#pragma once

#include "renderer/trace/camera/camera_projection.h"

namespace helio {

class ViewMapping {
 public:
  // Both of one film's size.
  ViewMapping(const CameraProjection& from, const CameraProjection& to);

  struct Point {
    float x, y, depth;  // pixels from the film's upper left corner; depth <= 0: the other view does not see it
  };
  // From film points (x, y), (x + 1, y), ... in pixels, and depths along the view axis, finite; by arrays.
  void map_row(float x, float y, int count, const float* depth, float* to_x, float* to_y, float* to_depth) const;

 private:
  Point along_row(const V3f& row, float x, float depth) const {
    const float scale = from_orthographic_ ? 1.0f : depth;
    const V3f at = (row + step_x_ * x) * scale + along_ * depth + offset_;
    const float inverse = to_orthographic_ ? 1.0f : 1 / at.z;
    return {at.x * inverse, at.y * inverse, at.z};
  }

  bool from_orthographic_, to_orthographic_;
  V3f corner_, step_x_, step_y_, along_, offset_;
};

}  // namespace helio
