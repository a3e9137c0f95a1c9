#include "renderer/trace/lights/light_power.h"

#include <map>
#include <utility>

#include "renderer/trace/lights/light_emission.h"

namespace helio {
namespace {

constexpr double kPiD = std::numbers::pi;
// Lookups per textured light: at least, at most, and over all lights of a scene.
constexpr double kMinLookups = 16, kMaxLookups = 16384, kMaxTotalLookups = 4e6;
constexpr double kDarkFloor = 0.01;

double luminance_d(const V3d& c) {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

bool is_planar(const AreaShape& shape) {
  return shape.kind == ShapeKind::triangle || shape.kind == ShapeKind::parallelogram;
}

// Texels under the light, repeats included, for texture coordinates that grow by uv_s and uv_t along s and t.
double covered_texels(const AreaLight& light, const TextureSlot& slot, const V2f& uv_s, const V2f& uv_t,
                      const TextureTable& textures) {
  if (!slot.present()) return 0;
  const V2f origin = transform_uv(slot, {0, 0});
  const V2f s = transform_uv(slot, uv_s) - origin, t = transform_uv(slot, uv_t) - origin;
  const double covered = std::abs(double(s.x) * t.y - double(s.y) * t.x) * textures.width(slot.image) *
                         textures.height(slot.image) * (light.shape.kind == ShapeKind::triangle ? 0.5 : 1.0);
  return std::isfinite(covered) ? covered : kMaxLookups;
}

// A point of the light, and its share of the area, for u in [0, 1)^2.
struct LightPoint {
  V2f st;
  double weight = 1;
};

LightPoint point_at(const AreaShape& shape, const V2f& u) {
  if (shape.kind == ShapeKind::parallelogram) return {u, 1};
  if (shape.kind == ShapeKind::triangle) return {square_to_triangle(u), 1};
  const float y = 1 - 2 * u.y, r = safe_sqrt(1 - y * y), phi = kTwoPi * u.x;
  const V3f local(r * std::cos(phi), y, r * std::sin(phi));
  return {sphere_uv(local), shape.kind == ShapeKind::ellipsoid ? area_stretch(shape, local) : 1.0};
}

double mean_of_lookups(const AreaLight& light, const TextureSlot& slot, const LightAlpha* alpha,
                       const TextureTable* textures, double lookups) {
  const int n = int(std::ceil(std::sqrt(lookups)));
  double sum = 0, weight = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const LightPoint p = point_at(light.shape, {(float(i) + 0.5f) / float(n), (float(j) + 0.5f) / float(n)});
      sum += p.weight * luminance_d(V3d(light_emission(light, slot, alpha, p.st, textures)));
      weight += p.weight;
    }
  }
  return sum / weight;
}

// The largest alpha that the light's factors allow, as coverage.
double most_coverage(const AreaLight& light, const LightAlpha& alpha) {
  double most = alpha.factor;
  if (is_planar(light.shape)) {
    most = std::max({most, double(alpha.factor) + alpha.factor_s, double(alpha.factor) + alpha.factor_t});
    if (light.shape.kind == ShapeKind::parallelogram) {
      most = std::max(most, double(alpha.factor) + alpha.factor_s + alpha.factor_t);
    }
  }
  if (alpha.mask) return most >= alpha.cutoff ? 1 : 0;
  return std::clamp(most, 0.0, 1.0);
}

bool varies(const AreaLight& light, const LightAlpha* alpha) {
  return light.textured || (alpha && (alpha->texture.present() || alpha->factor_s != 0 || alpha->factor_t != 0));
}

}  // namespace

std::vector<double> mean_radiances(const AreaLights& grouped, const std::vector<AreaEmitter>& emitters,
                                   const TextureTable* textures) {
  const auto alpha_of = [&](const AreaLight& light) {
    return light.alpha == kOpaqueEmitter ? nullptr : &grouped.alphas[light.alpha];
  };
  std::size_t varying = 0;
  for (const AreaLight& light : grouped.lights) varying += varies(light, alpha_of(light));
  const double limit =
      std::clamp(kMaxTotalLookups / double(std::max<std::size_t>(varying, 1)), kMinLookups, kMaxLookups);

  std::map<std::pair<int, TexelEncoding>, V4f> image_means;
  const auto image_mean = [&](const TextureSlot& slot) {
    const auto [found, fresh] = image_means.try_emplace({slot.image, slot.encoding});
    if (fresh) found->second = textures->mean(slot.image, slot.encoding);
    return found->second;
  };
  std::vector<double> means;
  means.reserve(grouped.lights.size());
  for (const AreaLight& light : grouped.lights) {
    const LightAlpha* alpha = alpha_of(light);
    const TextureSlot& slot = emitters[light.emitter].texture;
    double floor = kDarkFloor;
    V3d factor(light.radiance);
    if (alpha) floor *= most_coverage(light, *alpha);
    if (!(floor > 0)) {
      means.push_back(0);
      continue;
    }
    if (!varies(light, alpha)) {
      means.push_back(luminance_d(factor) * (alpha ? double(coverage(*alpha, {0, 0}, textures)) : 1.0));
      continue;
    }
    double texels = 0;
    if (light.textured) {
      const V4f mean = image_mean(slot);
      factor *= V3d(mean.x, mean.y, mean.z);
      texels = covered_texels(light, slot, light.uv_s, light.uv_t, *textures);
    }
    if (alpha && alpha->texture.present()) {
      floor *= image_mean(alpha->texture).w;
      texels = std::max(texels, covered_texels(light, alpha->texture, alpha->uv_s, alpha->uv_t, *textures));
    }
    const double mean = mean_of_lookups(light, slot, alpha, textures, std::clamp(texels, kMinLookups, limit));
    means.push_back(std::max(mean, floor * luminance_d(factor)));
  }
  return means;
}

double area_flux(const AreaLight& light, double mean_radiance) {
  return kPiD * mean_radiance * light.shape.area * (light.shape.two_sided ? 2 : 1);
}

double punctual_flux(const PunctualLight& light, double scene_radius) {
  const double intensity = luminance_d(V3d(light.intensity));
  switch (light.kind) {
    case PunctualKind::point:
      return 4 * kPiD * intensity;
    case PunctualKind::spot:
      return 2 * kPiD * intensity *
             (1 - 0.5 * (std::cos(double(light.inner_cone_angle)) + std::cos(double(light.outer_cone_angle))));
    case PunctualKind::directional:
      return kPiD * scene_radius * scene_radius * intensity;
    case PunctualKind::projector:
      break;
  }
  return 0;
}

double environment_flux(double mean_radiance, double scene_radius) {
  return kPiD * mean_radiance * kPiD * scene_radius * scene_radius;
}

}  // namespace helio
