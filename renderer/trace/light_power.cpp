#include "renderer/trace/light_power.h"

#include <map>
#include <utility>

namespace helio {
namespace {

constexpr double kPiD = std::numbers::pi;
// Lookups per textured light: at least, at most, and over all lights of a scene.
constexpr double kMinLookups = 16, kMaxLookups = 16384, kMaxTotalLookups = 4e6;
constexpr double kDarkFloor = 0.01;

double luminance_d(const V3d& c) {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

// Texels under the light, repeats included.
double covered_texels(const AreaLight& light, const TextureSlot& slot, const TextureTable& textures) {
  const V2f origin = transform_uv(slot, {0, 0});
  const V2f s = transform_uv(slot, light.uv_s) - origin, t = transform_uv(slot, light.uv_t) - origin;
  const double covered = std::abs(double(s.x) * t.y - double(s.y) * t.x) * textures.width(slot.image) *
                         textures.height(slot.image) * (light.shape.kind == ShapeKind::triangle ? 0.5 : 1.0);
  return std::isfinite(covered) ? covered : kMaxLookups;
}

V3d mean_of_lookups(const AreaLight& light, const TextureSlot& slot, const TextureTable& textures, double lookups) {
  const int n = int(std::ceil(std::sqrt(lookups)));
  V3d sum(0, 0, 0);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const V2f u((float(i) + 0.5f) / float(n), (float(j) + 0.5f) / float(n));
      const V2f st = light.shape.kind == ShapeKind::triangle ? detail::square_to_triangle(u) : u;
      const V4f value = textures.lookup(slot, light.uv + light.uv_s * st.x + light.uv_t * st.y);
      sum += V3d(value.x, value.y, value.z);
    }
  }
  return sum / (double(n) * n);
}

}  // namespace

std::vector<double> mean_radiances(const std::vector<AreaLight>& lights, const std::vector<AreaEmitter>& emitters,
                                   const TextureTable* textures) {
  std::size_t textured = 0;
  for (const AreaLight& light : lights) textured += light.textured;
  const double most =
      std::clamp(kMaxTotalLookups / double(std::max<std::size_t>(textured, 1)), kMinLookups, kMaxLookups);

  std::map<std::pair<int, TexelEncoding>, V3d> image_means;
  std::vector<double> means;
  means.reserve(lights.size());
  for (const AreaLight& light : lights) {
    const V3d factor(light.radiance);
    if (!light.textured) {
      means.push_back(luminance_d(factor));
      continue;
    }
    const TextureSlot& slot = emitters[light.emitter].texture;
    const auto [found, fresh] = image_means.try_emplace({slot.image, slot.encoding});
    if (fresh) {
      const V4f mean = textures->mean(slot.image, slot.encoding);
      found->second = V3d(mean.x, mean.y, mean.z);
    }
    const double lookups = std::clamp(covered_texels(light, slot, *textures), kMinLookups, most);
    const double mean = luminance_d(factor * mean_of_lookups(light, slot, *textures, lookups));
    means.push_back(std::max(mean, kDarkFloor * luminance_d(factor * found->second)));
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
  }
  return 0;
}

double environment_flux(double mean_radiance, double scene_radius) {
  return kPiD * mean_radiance * kPiD * scene_radius * scene_radius;
}

}  // namespace helio
