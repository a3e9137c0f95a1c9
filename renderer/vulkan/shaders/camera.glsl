// Primary rays: trace/camera/camera.cpp and trace/sampling/pixel_filter_sampling.cpp.
#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "base/base.glsl"
#include "tables/task.h"
#include "sampling/warp.glsl"

const uint kFilterBox = 0, kFilterTent = 1, kFilterGaussian = 2;
const uint kFilterPieces = 1024;
const double kFilterEnd = 4;
const double kFilterStep = kFilterEnd / kFilterPieces;

double copysign_double(double magnitude, double sign_of) {
  return sign_of < 0 ? -abs(magnitude) : abs(magnitude);
}

double tent_integral(double x) {
  const double a = min(abs(x), double(1));
  return copysign_double(a - 0.5 * a * a, x);
}
double inverse_tent_integral(double c) {
  const double a = 2 * abs(c);
  return copysign_double(a / (1 + sqrt(max(double(0), 1 - a))), c);
}

double filter_slope(CameraTable camera, uint i) {
  Doubles density = Doubles(camera.filter_density);
  return (density.at[i + 1] - density.at[i]) / kFilterStep;
}
double gaussian_integral(CameraTable camera, double x) {
  const double a = min(abs(x), kFilterEnd) / kFilterStep;
  const uint i = min(uint(a), kFilterPieces - 1);
  const double t = (a - double(i)) * kFilterStep;
  const double area = Doubles(camera.filter_integral).at[i] +
                      t * (Doubles(camera.filter_density).at[i] + 0.5 * filter_slope(camera, i) * t);
  return copysign_double(area, x);
}
double inverse_gaussian_integral(CameraTable camera, double c) {
  Doubles integral = Doubles(camera.filter_integral);
  const double wanted = min(abs(c), integral.at[kFilterPieces]);
  uint low = 0, high = kFilterPieces - 1;  // the last piece whose integral begins at or below it
  while (low < high) {
    const uint middle = (low + high + 1) / 2;
    if (integral.at[middle] <= wanted) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  const double rest = wanted - integral.at[low], p = Doubles(camera.filter_density).at[low];
  const double root = sqrt(max(double(0), p * p + 2 * filter_slope(camera, low) * rest));
  const double t = p + root > 0 ? 2 * rest / (p + root) : double(0);
  return copysign_double(kFilterStep * double(low) + clamp(t, double(0), kFilterStep), c);
}

// Distance from the pixel's centre along one axis, of a filter that is cut off at [low, high].
double sample_pixel_filter(CameraTable camera, double u, double low, double high) {
  const double scale = camera.filter_scale;
  if (camera.filter_kind == kFilterTent) {
    const double from = tent_integral(low / scale), to = tent_integral(high / scale);
    return clamp(scale * inverse_tent_integral(from + (to - from) * u), low, high);
  }
  const double from = gaussian_integral(camera, low / scale), to = gaussian_integral(camera, high / scale);
  return clamp(scale * inverse_gaussian_integral(camera, from + (to - from) * u), low, high);
}

void generate_ray(CameraTable camera, ivec2 pixel, vec2 in_pixel, vec2 lens, out vec3 origin, out vec3 direction) {
  dvec2 film = dvec2(pixel) + dvec2(in_pixel);
  if (camera.filter_kind != kFilterBox) {
    const dvec2 centre = dvec2(pixel) + 0.5;
    film.x = centre.x + sample_pixel_filter(camera, double(in_pixel.x), -centre.x, camera.width - centre.x);
    film.y = centre.y + sample_pixel_filter(camera, double(in_pixel.y), -centre.y, camera.height - centre.y);
  }
  vec3 offset;
  for (int k = 0; k < 3; ++k) {
    offset[k] = float(camera.corner[k] + camera.step_x[k] * film.x + camera.step_y[k] * film.y);
  }
  const bool orthographic = (camera.flags & kCameraOrthographic) != 0;
  origin = orthographic ? camera.origin + offset : camera.origin;
  direction = orthographic ? camera.forward : offset;
  if ((camera.flags & kCameraLens) != 0) {
    const vec3 focus = (orthographic ? camera.forward : offset) * camera.focus_distance;
    const vec2 disk = square_to_disk(lens);
    const vec3 on_lens = camera.right * (disk.x * camera.lens_radius) + camera.up * (disk.y * camera.lens_radius);
    origin += on_lens;
    direction = focus - on_lens;
  }
  direction *= 1.0 / sqrt(dot(direction, direction));
}

#endif
