#include "renderer/scene/mitsuba/fov.h"

#include <cmath>
#include <cstdlib>

namespace helio::mitsuba {

// fov is the angle along fov_axis; ours is the vertical one. Both come from the same focal length.
double vertical_fov(const Plugin& plugin, double aspect) {
  const std::string axis = lower_case(plugin.text("fov_axis", "x"));
  double across = 1;  // extent along the axis over the height
  if (axis == "x")
    across = aspect;
  else if (axis == "y")
    across = 1;
  else if (axis == "diagonal")
    across = std::hypot(1, aspect);
  else if (axis == "smaller")
    across = std::min(1.0, aspect);
  else if (axis == "larger")
    across = std::max(1.0, aspect);
  else
    plugin.fail("has fov_axis \"" + axis + "\", allowed: x, y, diagonal, smaller, larger");
  if (plugin.has("fov")) {
    const double fov = plugin.number("fov", 45, {1e-3, 179.999}) * std::numbers::pi / 180;
    return 2 * std::atan(std::tan(fov / 2) / across);
  }
  // "50mm" on 35 mm film, whose frame is 36 x 24 mm: the angle of its diagonal.
  const std::string focal = plugin.text("focal_length", "50mm");
  char* end = nullptr;
  const double mm = std::strtod(focal.c_str(), &end);
  if (end == focal.c_str() || !(mm > 0) || (*end != 0 && std::string(end) != "mm")) {
    plugin.fail("has focal_length \"" + focal + "\", allowed: a length above 0 as \"50mm\"");
    return 0.8;
  }
  const double half_diagonal = std::hypot(36.0, 24.0) / 2 / mm;
  return 2 * std::atan(half_diagonal / std::hypot(1, aspect));
}

}  // namespace helio::mitsuba
