// The kernel log-polar map of a picture around a gaze, and what depends on the distance from it (Mrad 2022, sections
// 2.2.2 and 4.1 to 4.2; kernel x^4 and buffer of 1 / 1.8 after Meng et al. 2018).
//
// A buffer has columns for distances and rows for angles. Eq. 2.3 prints e^(A K(u)) with A = L / w and u in columns,
// which is a length only if the kernel is applied to u / w: r = e^(L K(u / w)).
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "renderer/base/math.h"

namespace helio {

class KernelLogPolar {
 public:
  static constexpr double kBufferScale = 1.8;  // the picture's sides over the buffer's

  // Of a picture of so many pixels, with the gaze at a point of it or beside it, in pixels.
  KernelLogPolar(int width, int height, double gaze_x, double gaze_y)
      : gaze_x_(gaze_x),
        gaze_y_(gaze_y),
        farthest_(std::hypot(std::max(std::abs(gaze_x), std::abs(width - gaze_x)),
                             std::max(std::abs(gaze_y), std::abs(height - gaze_y)))),
        log_farthest_(std::log(std::max(farthest_, 2.0))),
        columns_(std::max(int(std::lround(width / kBufferScale)), 2)),
        rows_(std::max(int(std::lround(height / kBufferScale)), 4)) {}

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  double gaze_x() const { return gaze_x_; }
  double gaze_y() const { return gaze_y_; }
  double farthest() const { return farthest_; }  // pixels from the gaze to the farthest corner

  struct Point {
    double x = 0, y = 0;
  };
  // Pixels of the picture of a point of the buffer, eq. 2.3. Column in [0, columns()], row any.
  Point to_picture(double column, double row) const {
    const double r = distance_at(column), angle = row * (2 * std::numbers::pi / rows_);
    return {gaze_x_ + r * std::cos(angle), gaze_y_ + r * std::sin(angle)};
  }
  // Column and row, [0, rows()), of a point of the picture, eq. 2.2. Within a pixel of the gaze the column is 0.
  Point to_buffer(double x, double y) const {
    const double dx = x - gaze_x_, dy = y - gaze_y_;
    double angle = std::atan2(dy, dx);
    if (angle < 0) angle += 2 * std::numbers::pi;
    const double row = angle * (rows_ / (2 * std::numbers::pi));
    return {column_at(std::hypot(dx, dy)), row < rows_ ? row : 0};
  }
  // Pixels from the gaze.
  double distance_at(double column) const {
    const double u = column / columns_, square = u * u;
    return std::exp(log_farthest_ * square * square);
  }
  double column_at(double distance) const {
    const double k = std::log(std::max(distance, 1.0)) / log_farthest_;
    return std::min(std::sqrt(std::sqrt(k)), 1.0) * columns_;
  }
  // Eq. 4.5: columns before it lie within the radius. The last one never does, for what is between it and the corner.
  int first_column(double radius) const { return std::min(int(std::ceil(column_at(radius))), columns_ - 1); }

  // Diameter of the radial blur at a distance, pixels of the buffer: eq. 4.4, whose pixels are those of the paper's
  // buffer of 1,080 rows. Taken as they are, they would be all of a small picture's buffer outside the disk.
  double blur_diameter(double distance) const {
    return std::max(3 + 0.8 * (distance / farthest_ - 0.1) / 0.05, 0.0) * rows_ / kPublishedRows;
  }
  // Bias of the level of detail in a column, levels: eq. 4.2 without upscaling's own, and 4.3.
  double detail_bias(double column) const {
    const double u = column / columns_, k = std::clamp(u * u * u * u, 0.0, 1.0), smooth = k * k * (3 - 2 * k);
    return kBaseBias + 3 * smooth * smooth * smooth;
  }
  static constexpr double kBaseBias = 0.3;
  static constexpr double kPublishedRows = 1080;

 private:
  double gaze_x_, gaze_y_, farthest_, log_farthest_;
  int columns_, rows_;
};

}  // namespace helio
