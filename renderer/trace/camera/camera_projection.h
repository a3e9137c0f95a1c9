// Where on its film a camera sees a point: the inverse of Camera::generate_ray for the centre of the lens.
#pragma once

#include "renderer/trace/camera/camera.h"

namespace helio {

struct FilmPoint {
  double x = 0, y = 0;    // pixels from the film's upper left corner
  double footprint = 0;   // side of a pixel at the point, across the view axis, scene units; directions: radians or so
  bool in_front = false;  // false: the camera does not see that way, the rest means nothing
};

class CameraProjection {
 public:
  CameraProjection(const CameraPose& pose, int width, int height, const V3d& scene_origin);

  FilmPoint point(const V3d& position) const;     // rebased scene coordinates
  FilmPoint direction(const V3d& towards) const;  // of something infinitely far away

  // Of an offset from the origin: film x and y times the third coordinate, and that; orthographic: x, y and the depth.
  // Linear, orthographic: affine.
  V3d homogeneous(const V3d& offset) const {
    const V3d from = orthographic_ ? offset - corner_ : offset;
    return {dot(to_x_, from), dot(to_y_, from), dot(to_depth_, from)};
  }

  // Side of a pixel at a depth along the view axis, > 0.
  double footprint(double depth) const { return orthographic_ ? step_ : step_ * depth; }

  // Rebased; the lens's centre. Orthographic cameras look at everything from infinity along direction_at().
  const V3d& origin() const { return origin_; }
  bool orthographic() const { return orthographic_; }
  // Unit, through a point of the film given in pixels; orthographic: the same everywhere.
  V3d direction_at(double film_x, double film_y) const;
  // What is seen through that point of the film at `depth`, along the view axis.
  V3d position_at(double film_x, double film_y, double depth) const {
    return origin_ + offset_at(film_x, film_y, depth);
  }
  // The same from the origin.
  V3d offset_at(double film_x, double film_y, double depth) const {
    const V3d across = corner_ + step_x_ * film_x + step_y_ * film_y;
    return orthographic_ ? across + forward_ * depth : across * depth;
  }

  // offset_at(), only how far it reaches along one direction.
  class Heights {
   public:
    double at(double film_x, double film_y, double depth) const {
      const double across = corner_ + step_x_ * film_x + step_y_ * film_y;
      return orthographic_ ? across + forward_ * depth : across * depth;
    }

   private:
    friend class CameraProjection;
    bool orthographic_ = false;
    double corner_ = 0, step_x_ = 0, step_y_ = 0, forward_ = 0;
  };
  Heights heights_along(const V3d& direction) const;

 private:
  FilmPoint project(const V3d& offset) const;

  bool orthographic_ = false;
  double step_ = 0;
  V3d origin_, step_x_, step_y_, corner_, forward_;
  V3d to_x_, to_y_, to_depth_;  // rows of the inverse of (step_x, step_y, corner or forward)
};

}  // namespace helio
