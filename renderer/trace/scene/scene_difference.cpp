#include "renderer/trace/scene/scene_difference.h"

#include <algorithm>
#include <cmath>

#include "renderer/scene/load/scene_edit.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {
namespace {

constexpr double kBrightest = 0x1p20, kSameFactor = 1e-6;

// By which factor everything that was looked at has become brighter, per channel.
class Brightness {
 public:
  void look(const Rgb& from, const Rgb& to) {
    for (int c = 0; c < 3; ++c) {
      if (from[c] == to[c] && from[c] == 0) continue;
      const double factor = double(to[c]) / double(from[c]);
      if (!(factor >= 1 / kBrightest && factor <= kBrightest)) {
        fits_ = false;
      } else if (factor_[c] == 0) {
        factor_[c] = factor;
      } else if (!(std::abs(factor - factor_[c]) <= kSameFactor * factor_[c])) {
        fits_ = false;
      }
    }
  }
  std::optional<Rgb> factor() const {
    if (!fits_) return std::nullopt;
    const auto channel = [&](int c) { return factor_[c] > 0 ? float(factor_[c]) : 1.0f; };
    return Rgb(channel(0), channel(1), channel(2));
  }

 private:
  double factor_[3] = {0, 0, 0};  // 0: the channel was black so far
  bool fits_ = true;
};

std::vector<bool> changed_materials(const SceneDescription& from, const SceneDescription& to) {
  std::vector<bool> changed(from.materials.size());
  for (std::size_t i = 0; i < changed.size(); ++i)
    changed[i] = material_values(from.materials[i]) != material_values(to.materials[i]);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < changed.size(); ++i) {
      const Material& material = from.materials[i];
      if (changed[i] || material.model != MaterialModel::blend) continue;
      changed[i] = changed[std::size_t(material.blend.first)] || changed[std::size_t(material.blend.second)];
      more |= changed[i];
    }
  }
  return changed;
}

SurfaceChange change_of(const Object& object, const std::vector<bool>& materials) {
  bool any = false, all = true;
  const auto look = [&](int material) {
    any |= materials[std::size_t(material)];
    all &= materials[std::size_t(material)];
  };
  for (const TriangleMesh& mesh : object.meshes) look(mesh.material);
  for (const Sphere& sphere : object.spheres) look(sphere.material);
  if (!any) return SurfaceChange::none;
  return all ? SurfaceChange::all : SurfaceChange::some;
}

std::optional<Rgb> common_brightness(const SceneDescription& from, const SceneDescription& to) {
  Brightness brightness;
  for (std::size_t i = 0; i < from.materials.size(); ++i) {
    const MaterialValues a = material_values(from.materials[i]), b = material_values(to.materials[i]);
    if (a.base_color != b.base_color || a.roughness != b.roughness) return std::nullopt;
    const bool unlit = from.materials[i].model == MaterialModel::unlit;  // what it shows is its colour
    brightness.look(unlit ? a.base_color : a.emission, unlit ? b.base_color : b.emission);
  }
  for (std::size_t i = 0; i < from.lights.size(); ++i)
    brightness.look(from.lights[i].intensity, to.lights[i].intensity);
  if (from.environment) brightness.look(from.environment->radiance, to.environment->radiance);
  return brightness.factor();
}

}  // namespace

std::optional<SceneDifference> scene_difference(const RenderScene& from, const RenderScene& to) {
  SceneDifference difference;
  if (&from == &to) return difference;
  const SceneData &a = from.impl(), &b = to.impl();
  if (a.assets != b.assets || a.origin != b.origin) return std::nullopt;
  const SceneDescription &before = a.description, &after = b.description;

  std::vector<bool> materials = changed_materials(before, after);
  const bool repainted = std::find(materials.begin(), materials.end(), true) != materials.end();
  bool moved = false;
  std::vector<SurfaceChange> surfaces(before.instances.size(), SurfaceChange::none);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Instance& instance = before.instances[i];
    if (instance.to_world != after.instances[i].to_world) {
      surfaces[i] = SurfaceChange::all;
      moved = true;
    } else if (repainted) {
      surfaces[i] = change_of(a.assets->objects[std::size_t(instance.object)], materials);
    }
  }
  if (moved || repainted) difference.surfaces = std::move(surfaces);
  if (repainted) difference.materials = std::move(materials);
  for (std::size_t i = 0; i < before.lights.size(); ++i)
    difference.lights |= before.lights[i].intensity != after.lights[i].intensity;
  difference.environment = before.environment && before.environment->radiance != after.environment->radiance;
  if (!moved && !difference.empty()) difference.brightness = common_brightness(before, after);
  return difference;
}

}  // namespace helio
