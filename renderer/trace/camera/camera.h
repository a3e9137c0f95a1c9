// Camera poses and primary rays.
#pragma once

#include <string>

#include "renderer/base/math.h"
#include "renderer/base/pixel_filter.h"
#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/trace/camera/ray_cone.h"

namespace helio {

// A camera in world coordinates (not rebased), independent of the film's size. Plain data, as it travels in a view.
struct CameraPose {
  Projection projection = Projection::perspective;
  V3d position{0, 0, 0};                               // coordinates in [-1e12, 1e12]
  V3d right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  // orthonormal; pixel rows grow along -up
  double vertical_fov = 0.8;  // radians, full angle; allowed [0.0017 (0.1 degrees), 3.1242 (179 degrees)]
  double half_height = 1;     // orthographic, [1e-12, 1e12]
  double lens_radius = 0;     // [0, 1e12]; 0: pinhole
  double focus_distance = 1;  // [1e-12, 1e12]
  // Width / height of what must be seen whole, [1e-6, 1e6]: in a narrower picture vertical_fov and half_height are those
  // of its middle part, as high as that. 0: they are the picture's, whatever its width.
  double aspect = 0;

  bool operator==(const CameraPose&) const = default;
};

// The result is valid whatever the description says: values out of range become the nearest in range.
CameraPose camera_pose(const CameraDescription& camera);

// Position and target in world coordinates; `up` need not be perpendicular. invalid_argument when target == position,
// up is parallel to the view direction or a coordinate is not finite or beyond 1e12.
Result<CameraPose> look_at(const V3d& position, const V3d& target, const V3d& up, double vertical_fov);

// Adds a problem for every field that is not finite or outside its range; `where` prefixes the field names.
void validate(const CameraPose& pose, const std::string& where, Problems& problems);

// The pose in a picture of this size, without an aspect of its own: all that it frames is seen, as far as 179 degrees
// and a half height of 1e12 reach. Within half a pixel the aspect is the picture's.
CameraPose fitted(CameraPose pose, int width, int height);
// For people, where the picture's aspect is not that of the pose; empty where it is.
std::string aspect_notice(const CameraPose& pose, int width, int height);

struct CameraRay {
  V3f origin, direction;  // rebased scene coordinates; direction is unit
};

// A pose bound to a film with its filter and to the scene's origin. Immutable, cheap to copy. Give it a fitted pose: an
// aspect of its own is not looked at.
class Camera {
 public:
  Camera(const CameraPose& pose, int width, int height, const V3d& scene_origin, const PixelFilter& filter = {});

  // Pixel (x right, y down), position in it in [0,1]^2 (its centre at .5), lens sample in [0,1)^2. Pixel and position
  // come apart because their float sum would have steps of 1 / 256 pixel at the far side of the largest films, and
  // would round up into the next pixel. With another filter than the box, in_pixel is a uniform sample from which the
  // position is drawn (pixel_filter_sampling.h), in this pixel or another of the film.
  CameraRay generate_ray(int x, int y, const V2f& in_pixel, const V2f& lens) const;

  // Through a pixel's centre and the lens's, whatever the filter.
  CameraRay centre_ray(int x, int y) const { return ray_at(x + 0.5, y + 0.5, V2f(0.5f, 0.5f)); }

  const V3f& forward() const { return forward_; }  // unit
  bool pinhole() const { return lens_radius_ == 0; }
  // A pixel's cone, the lens taken as a point.
  const RayCone& cone() const { return cone_; }
  void widen_cone(float factor) {
    cone_.width *= factor;
    cone_.spread *= factor;
  }
  int width() const { return width_; }  // of the film, in pixels
  int height() const { return height_; }

  // All that generate_ray() works with, for tracers on other devices. A point of the film, in pixels from its upper left
  // corner, lies at corner + x step_x + y step_y; perspective: one unit before the lens.
  struct Parts {
    V3f origin, forward, right, up;
    V3d step_x, step_y, corner;
    float lens_radius, focus_distance;
    bool orthographic;
    PixelFilter filter;
  };
  Parts parts() const {
    return {origin_,      forward_,        right_,        up_,    step_x_, step_y_, corner_,
            lens_radius_, focus_distance_, orthographic_, filter_};
  }

 private:
  friend class CameraImportance;

  // Pixels from the film's upper left corner.
  CameraRay ray_at(double film_x, double film_y, const V2f& lens) const;

  V3f origin_, forward_, right_, up_;
  V3d step_x_, step_y_, corner_;
  float lens_radius_ = 0, focus_distance_ = 1;
  bool orthographic_ = false;
  RayCone cone_;
  PixelFilter filter_;
  int width_ = 0, height_ = 0;
};

}  // namespace helio
