#include "renderer/preview/view_mapping.h"

namespace helio {

ViewMapping::ViewMapping(const CameraProjection& from, const CameraProjection& to)
    : from_orthographic_(from.orthographic()), to_orthographic_(to.orthographic()) {
  // homogeneous() is affine, and linear but for orthographic views.
  const V3d zero = to.homogeneous(V3d(0, 0, 0));
  const auto linear = [&](const V3d& v) { return to.homogeneous(v) - zero; };
  const V3d corner = from.offset_at(0, 0, 0), apart = from.origin() - to.origin();
  // Perspective views scale what offset_at() says at depth 1.
  const V3d base = from_orthographic_ ? corner : from.offset_at(0, 0, 1);
  const V3d step_x = from.offset_at(1, 0, 1) - from.offset_at(0, 0, 1);
  const V3d step_y = from.offset_at(0, 1, 1) - from.offset_at(0, 0, 1);
  step_x_ = V3f(linear(step_x));
  step_y_ = V3f(linear(step_y));
  if (from_orthographic_) {
    corner_ = V3f(linear(base) + linear(apart) + zero);
    along_ = V3f(linear(from.offset_at(0, 0, 1) - corner));
    offset_ = V3f(0, 0, 0);
  } else {
    corner_ = V3f(linear(base));
    along_ = V3f(0, 0, 0);
    offset_ = V3f(linear(apart) + zero);
  }
}

void ViewMapping::map_row(float x, float y, int count, const float* depth, float* to_x, float* to_y,
                          float* to_depth) const {
  const ViewMapping mapping = *this;  // a copy, so that what is written cannot be a part of it
  const V3f row = corner_ + step_y_ * y;
  for (int i = 0; i < count; ++i) {
    const Point to = mapping.along_row(row, x + float(i), depth[i]);
    to_x[i] = to.x;
    to_y[i] = to.y;
    to_depth[i] = to.depth;
  }
}

}  // namespace helio
