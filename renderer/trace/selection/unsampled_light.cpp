#include "renderer/trace/selection/unsampled_light.h"

namespace helio {

std::vector<std::string> unsampled_light(Integrator integrator, const SceneFeatures& features) {
  std::vector<std::string> missing;
  const bool connects =
      integrator == Integrator::bdpt || integrator == Integrator::pt_bdpt || integrator == Integrator::lvc;
  // No ray meets a delta light, and nothing is joined to a vertex on a delta surface: a path no two neighbours of which
  // can be joined is made by no technique without merging (Veach 1997, section 8.3).
  const bool never_hit = features.delta_lights && features.delta_lobes;
  const bool hit_by_chance = features.area_lights || features.environment;
  if (integrator == Integrator::path) {
    if (never_hit) {
      missing.push_back(
          "missing: light of lights without extent (point, spot, directional, projector) that arrives by way of smooth "
          "mirrors or smooth glass (caustics, and what lies behind panes)");
    }
    if (features.caustics && hit_by_chance) {
      missing.push_back(
          "by chance alone: light that mirrors, glass or glossy surfaces cast on others (caustics), the more rarely "
          "the smaller the light");
    }
  }
  if (integrator == Integrator::pt_bdpt && never_hit) {
    missing.push_back(
        "missing: where a tile was given no light paths, light of lights without extent (point, spot, directional, "
        "projector) that arrives by way of smooth mirrors or smooth glass (faint caustics, and what lies behind "
        "panes)");
  }
  if (connects) {
    if (never_hit) {
      missing.push_back(
          "missing: light of lights without extent (point, spot, directional, projector) that arrives by way of smooth "
          "mirrors or smooth glass, where it is seen by way of such (caustics in a mirror)");
    }
    if (features.delta_lobes && hit_by_chance) {
      missing.push_back(
          "by chance alone: light that arrives by way of smooth mirrors or smooth glass, where it is seen by way of "
          "such (caustics in a mirror), the more rarely the smaller the light");
    }
  }
  if (integrator == Integrator::light) {
    if (features.delta_lobes) missing.push_back("missing: all that smooth mirrors and smooth glass show");
    if (features.smooth_normals || features.normal_maps) {
      missing.push_back(
          "missing: some of the light that leaves surfaces towards the camera at grazing angles, where normals of "
          "vertices or maps are bent towards it");
    }
    if (features.environment) {
      missing.push_back(
          "by chance alone: light of the environment that gets in through small openings, the more rarely the smaller "
          "they are in the whole scene");
    }
  }
  if (merges(integrator)) {
    missing.push_back(
        "biased: light is blurred over the merging radius, less and less with more samples; the estimate of what that "
        "does to the mean is reported with the error");
  }
  return missing;
}

}  // namespace helio
