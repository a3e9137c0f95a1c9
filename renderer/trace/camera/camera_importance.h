// The camera as the end of light paths: through which point of its lens and film it sees a point, and with which
// density its own rays reach it.
#pragma once

#include "renderer/base/pixel_filter.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/sampling/sampler.h"

namespace helio {

struct CameraConnection {
  V3f direction;                  // unit, from the point towards the camera
  float distance = 0;             // to the lens; orthographic: to its plane
  double film_x = 0, film_y = 0;  // pixels from the upper left corner; on the film
  // Of the camera's rays through the point: pixels per solid angle, of an orthographic camera pixels per area across
  // the ray. 0: the camera does not see the point.
  double density = 0;

  // In pixels per area of a surface there; `cosine`: between its normal and the direction.
  double pdf_area(double cosine, bool finite) const {
    return density * cosine / (finite ? double(distance) * distance : 1.0);
  }
};

class CameraImportance {
 public:
  explicit CameraImportance(const Camera& camera);

  // False: all rays through one point of the lens are parallel (orthographic), and arrive with the same density
  // everywhere.
  bool finite() const { return !orthographic_; }
  // Rebased scene coordinates; `lens` as of Camera::generate_ray().
  CameraConnection connect(const V3f& point, const V2f& lens) const;
  // CameraConnection::density of a ray of Camera::generate_ray() along the unit direction.
  double density(const V3f& direction) const;

  // The pixels whose filters reach a point of the film, and the share of its radiance that is theirs: the density with
  // which Camera::generate_ray() would draw the point for that pixel. Calls `pixel(x, y, share)`.
  template <typename Function>
  void for_each_pixel(double film_x, double film_y, Function&& pixel) const {
    if (filter_.kind == PixelFilterKind::box) {
      pixel(std::min(int(film_x), width_ - 1), std::min(int(film_y), height_ - 1), 1.0);
      return;
    }
    const Reach columns = reach(film_x, width_), rows = reach(film_y, height_);
    for (int y = rows.first; y <= rows.last; ++y) {
      const double share_y = share(film_y, y, height_);
      if (!(share_y > 0)) continue;
      for (int x = columns.first; x <= columns.last; ++x) {
        const double share_x = share(film_x, x, width_);
        if (share_x > 0) pixel(x, y, share_x * share_y);
      }
    }
  }

 private:
  struct Reach {
    int first, last;
  };
  Reach reach(double at, int size) const;
  double share(double at, int pixel, int size) const;

  bool orthographic_ = false;
  int width_, height_;
  double step_ = 0;
  double lens_radius_ = 0, focus_distance_ = 1;
  V3d origin_, forward_, right_, down_;
  PixelFilter filter_;
};

}  // namespace helio
