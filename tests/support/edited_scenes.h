// A scene to be edited, and edits of it.
#pragma once

#include <gtest/gtest.h>

#include "renderer/trace/scene/edit_scene.h"
#include "tests/support/test_scenes.h"

namespace helio::test {

// A floor under a sky and a sun, with two boxes on it far from each other. Instances: 0 floor, 1 and 2 boxes left and
// right; materials of the same numbers.
inline SceneDescription yard() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0.8f, 0.3f, 0.2f)), lambert(Rgb(0.2f, 0.3f, 0.8f))};
  add_mesh(scene, quad({-6, 0, 3}, {12, 0, 0}, {0, 0, -6}, 0));
  add_mesh(scene, box({-3.5f, 0, -0.5f}, {-2.5f, 1.2f, 0.5f}, 1));
  add_mesh(scene, box({3, 0, -0.5f}, {4, 1.2f, 0.5f}, 2));
  PunctualLight sun;
  sun.kind = PunctualKind::directional;
  sun.direction = normalize(V3d(0.7, -1, -0.4));
  sun.intensity = Rgb(2, 2, 2);
  scene.lights = {sun};
  scene.environment = Environment{};
  scene.environment->radiance = Rgb(0.3f, 0.35f, 0.4f);
  return scene;
}

inline CameraPose yard_camera() {
  return camera_at({0, 5, 8}, {0, 0, 0}, 50);
}

inline std::shared_ptr<const RenderScene> edited(const std::shared_ptr<const RenderScene>& base,
                                                 const std::vector<SceneEdit>& edits) {
  SceneChanges changes;
  if (!edits.empty()) {
    const auto resolved = resolve_edits(base->description(), edits);
    if (!resolved) {
      ADD_FAILURE() << resolved.error().to_string();
      return nullptr;
    }
    changes = *resolved;
  }
  auto scene = edit_scene(base, changes);
  EXPECT_TRUE(scene.ok()) << scene.error().to_string();
  return scene.ok() ? *scene : nullptr;
}

inline ObjectEdit moved_by(std::uint32_t instance, const V3d& offset) {
  ObjectEdit edit{instance, M44d(), true};
  edit.transform.setTranslation(offset);
  return edit;
}

inline MaterialEdit painted(std::uint32_t material, const Rgb& color) {
  return {material, color, std::nullopt, std::nullopt};
}

inline MaterialEdit shining(std::uint32_t material, const Rgb& emission) {
  return {material, std::nullopt, emission, std::nullopt};
}

}  // namespace helio::test
