// Two rooms for tests of the path kernels: what the plain kernel knows, and something of everything.
#pragma once

#include "tests/support/test_scenes.h"

namespace helio::test {

inline SceneDescription lambert_room() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.7f, 0.6f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(9, 8, 7))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  add_mesh(scene, box({-0.4f, -1, -0.5f}, {0.2f, -0.3f, 0.1f}, 0));
  add_mesh(scene, quad({-0.3f, 0.99f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1));
  return scene;
}

// Something of everything: glass, metal, instances, spheres, alpha, vertex normals, an environment, a point light.
inline SceneDescription mixed_scene() {
  SceneDescription scene = lambert_room();
  scene.materials.push_back(glass(1.4f));
  Material metal;
  metal.metallic = 1;
  metal.roughness = 0.4f;
  metal.base_color = Rgb(0.9f, 0.6f, 0.3f);
  scene.materials.push_back(metal);
  Material pane = lambert(Rgb(0.2f, 0.8f, 0.2f));
  pane.alpha_mode = AlphaMode::blend;
  pane.base_alpha = 0.5f;
  scene.materials.push_back(pane);
  add_sphere(scene, {0.5f, -0.6f, 0.2f}, 0.35f, 2);
  Object object;
  object.meshes.push_back(box({-0.1f, -0.1f, -0.1f}, {0.1f, 0.1f, 0.1f}, 3));
  for (const V3f& p : object.meshes[0].positions) object.meshes[0].normals.push_back(normalize(p));
  const int index = add_object(scene, object);
  M44d m;
  m[3][0] = -0.6;
  add_instance(scene, index, m);
  m[3][1] = 0.5;
  m[0][0] = -1.5;
  add_instance(scene, index, m);
  add_mesh(scene, quad({-0.9f, -0.9f, 0.6f}, {1.8f, 0, 0}, {0, 1.2f, 0}, 4));
  PunctualLight light;
  light.position = {0.8, 0.8, 0.8};
  light.intensity = Rgb(0.2f, 0.2f, 0.3f);
  scene.lights = {light};
  scene.environment = Environment{};
  return scene;
}

}  // namespace helio::test
