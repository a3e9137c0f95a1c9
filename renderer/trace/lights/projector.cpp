#include "renderer/trace/lights/projector.h"

#include <cmath>

#include "renderer/scene/images/texture.h"

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

// Columns of the inverse of the matrix with the rows across, down and depth, times its determinant.
struct Inverse {
  explicit Inverse(const PictureProjection& p)
      : along_u(cross(p.down, p.depth)), along_v(cross(p.depth, p.across)), center(cross(p.across, p.down)) {
    determinant = dot(p.depth, center);
  }
  bool exists() const { return std::isfinite(determinant) && determinant != 0; }

  V3d along_u, along_v, center;
  double determinant;
};

// What one texel's light is spread over at depth z, for a cosine to the axis.
Rgb spread_light(const Projector& projector, const V2f& uv, float z, float cosine, const TextureTable* textures) {
  const float spread = 1 / (z * z * cosine);
  if (!projector.picture.present()) return Rgb(spread);
  const V4f texel = textures->lookup(projector.picture, uv);
  return Rgb(texel.x, texel.y, texel.z) * spread;
}

}  // namespace

Projector make_projector(const PunctualLight& light) {
  const PictureProjection& p = light.projection;
  Projector out;
  out.across = V3f(p.across);
  out.down = V3f(p.down);
  out.depth = V3f(p.depth);
  out.axis = V3f(light.direction);
  out.picture = p.picture;
  const Inverse inverse(p);
  if (!inverse.exists()) return out;
  out.along_u = V3f(inverse.along_u / inverse.determinant);
  out.along_v = V3f(inverse.along_v / inverse.determinant);
  out.center = V3f(inverse.center / inverse.determinant);
  out.determinant = std::abs(inverse.determinant);
  return out;
}

Rgb projected(const Projector& projector, const V3f& direction, const TextureTable* textures) {
  const float z = dot(projector.depth, direction), cosine = dot(projector.axis, direction);
  if (!(z > 0) || !(cosine > 0)) return {0, 0, 0};
  const V2f uv(0.5f + dot(projector.across, direction) / z, 0.5f + dot(projector.down, direction) / z);
  if (!(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1)) return {0, 0, 0};
  return spread_light(projector, uv, z, cosine, textures);
}

ProjectorDeparture depart(const Projector& projector, const V2f& u, const TextureTable* textures) {
  ProjectorDeparture departure;
  const V3f at = projector.along_u * (u.x - 0.5f) + projector.along_v * (u.y - 0.5f) + projector.center;
  departure.direction = normalize_any(at);
  departure.pdf_w = departure_pdf_w(projector, departure.direction);
  const float z = dot(projector.depth, departure.direction), cosine = dot(projector.axis, departure.direction);
  if (z > 0 && cosine > 0) departure.factor = spread_light(projector, u, z, cosine, textures);
  return departure;
}

// The picture at depth 1 has the area |depth| / |det M|, is 1 / z away along a unit direction whose depth is z, and is
// seen at the cosine z / |depth|.
double departure_pdf_w(const Projector& projector, const V3f& direction) {
  const double z = dot(projector.depth, direction);
  return z > 0 ? projector.determinant / (z * z * z) : 0.0;
}

// Flux: the irradiance times the picture's area, both at depth 1. With the rows across, down, depth of M, corners lie
// at M^-1 (+-1/2, +-1/2, 1), and two sides of the picture span |depth| / |det M|. Exact where the axis is along the
// depth.
ProjectorPower projector_power(const PunctualLight& light, const TextureTable* textures) {
  const PictureProjection& p = light.projection;
  const Inverse inverse(p);
  if (!inverse.exists()) return {};
  double angle = 0;
  for (const double u : {-0.5, 0.5}) {
    for (const double v : {-0.5, 0.5}) {
      const V3d corner = (inverse.along_u * u + inverse.along_v * v + inverse.center) / inverse.determinant;
      angle = std::max(angle, std::atan2(length(cross(light.direction, corner)), dot(light.direction, corner)));
    }
  }
  angle = std::min(angle, std::numbers::pi / 2);
  ProjectorPower power;
  power.flux = luminance_d(light.intensity.x, light.intensity.y, light.intensity.z) *
               mean_luminance(p.picture, textures) / std::abs(inverse.determinant);
  const double half_sine = std::sin(angle / 2);  // 1 - cos = 2 sin^2 of the half, which keeps its digits
  power.intensity = power.flux / (4 * std::numbers::pi * half_sine * half_sine);
  power.half_angle = float(angle);
  return power;
}

}  // namespace helio
