#include "renderer/trace/projector.h"

#include <cmath>

#include "renderer/scene/texture.h"

namespace helio {
namespace {

// Lookups along each side of the picture.
constexpr int kMinLookups = 4, kMaxLookups = 128;
// Share of its image's mean that a picture counts for at least: it may be bright between the lookups.
constexpr double kDarkFloor = 0.01;

double luminance_d(double r, double g, double b) {
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

double mean_luminance(const TextureSlot& picture, const TextureTable* textures) {
  if (!picture.present()) return 1;
  const int image = picture.image;
  const int n = std::clamp(std::max(textures->width(image), textures->height(image)), kMinLookups, kMaxLookups);
  double sum = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const V4f texel = textures->lookup(picture, {(float(i) + 0.5f) / float(n), (float(j) + 0.5f) / float(n)});
      sum += luminance_d(texel.x, texel.y, texel.z);
    }
  }
  const V4f mean = textures->mean(image, picture.encoding);
  return std::max(sum / (double(n) * n), kDarkFloor * luminance_d(mean.x, mean.y, mean.z));
}

}  // namespace

Projector make_projector(const PunctualLight& light) {
  const PictureProjection& p = light.projection;
  return {V3f(p.across), V3f(p.down), V3f(p.depth), V3f(light.direction), p.picture};
}

Rgb projected(const Projector& projector, const V3f& direction, const TextureTable* textures) {
  const float z = dot(projector.depth, direction), cosine = dot(projector.axis, direction);
  if (!(z > 0) || !(cosine > 0)) return {0, 0, 0};
  const V2f uv(0.5f + dot(projector.across, direction) / z, 0.5f + dot(projector.down, direction) / z);
  if (!(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1)) return {0, 0, 0};
  const float spread = 1 / (z * z * cosine);
  if (!projector.picture.present()) return Rgb(spread);
  const V4f texel = textures->lookup(projector.picture, uv);
  return Rgb(texel.x, texel.y, texel.z) * spread;
}

// Flux: the irradiance times the picture's area, both at depth 1. With the rows across, down, depth of M, corners lie
// at M^-1 (+-1/2, +-1/2, 1), and two sides of the picture span |depth| / |det M|. Exact where the axis is along the
// depth.
ProjectorPower projector_power(const PunctualLight& light, const TextureTable* textures) {
  const PictureProjection& p = light.projection;
  const V3d along_u = cross(p.down, p.depth), along_v = cross(p.depth, p.across), center = cross(p.across, p.down);
  const double determinant = dot(p.depth, center);
  if (!std::isfinite(determinant) || determinant == 0) return {};
  double angle = 0;
  for (const double u : {-0.5, 0.5}) {
    for (const double v : {-0.5, 0.5}) {
      const V3d corner = (along_u * u + along_v * v + center) / determinant;
      angle = std::max(angle, std::atan2(length(cross(light.direction, corner)), dot(light.direction, corner)));
    }
  }
  angle = std::min(angle, std::numbers::pi / 2);
  ProjectorPower power;
  power.flux = luminance_d(light.intensity.x, light.intensity.y, light.intensity.z) *
               mean_luminance(p.picture, textures) / std::abs(determinant);
  const double half_sine = std::sin(angle / 2);  // 1 - cos = 2 sin^2 of the half, which keeps its digits
  power.intensity = power.flux / (4 * std::numbers::pi * half_sine * half_sine);
  power.half_angle = float(angle);
  return power;
}

}  // namespace helio
