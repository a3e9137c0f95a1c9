#include "tests/bench/scenes/height_field.h"

#include <cmath>
#include <numbers>

namespace helio::bench {

namespace {

constexpr double kAmplitude = 0.25;

double height(double u, double v) {
  double sum = 0;
  for (const int k : {3, 7, 17, 41, 79})
    sum += std::sin(2 * std::numbers::pi * k * u + k) * std::sin(2 * std::numbers::pi * k * v + 2 * k) / k;
  return kAmplitude * sum;
}

TriangleMesh grid(int quads_a_side) {
  const int corners = quads_a_side + 1;
  TriangleMesh mesh;
  mesh.positions.reserve(std::size_t(corners) * corners);
  mesh.indices.reserve(6 * std::size_t(quads_a_side) * quads_a_side);
  for (int j = 0; j < corners; ++j) {
    for (int i = 0; i < corners; ++i) {
      const double u = double(i) / quads_a_side, v = double(j) / quads_a_side;
      mesh.positions.emplace_back(float(2 * u - 1), float(height(u, v)), float(2 * v - 1));
      if (i == quads_a_side || j == quads_a_side) continue;
      const auto corner = std::uint32_t(j * corners + i), below = corner + std::uint32_t(corners);
      mesh.indices.insert(mesh.indices.end(), {corner, below, below + 1, corner, below + 1, corner + 1});
    }
  }
  return mesh;
}

CameraDescription camera() {
  const V3d position(0, 0.9, 1.4), back = normalize(position), up = cross(back, V3d(1, 0, 0));
  CameraDescription camera;
  camera.name = "camera";
  camera.vertical_fov = 0.75;
  camera.to_world = M44d(1, 0, 0, 0,                              //
                         up.x, up.y, up.z, 0,                     //
                         back.x, back.y, back.z, 0,               //
                         position.x, position.y, position.z, 1);
  return camera;
}

}  // namespace

SceneDescription height_field(int quads_a_side) {
  SceneDescription scene;
  scene.name = "height field";
  Material grey;
  grey.name = "grey";
  grey.base_color = Rgb(0.7f);
  grey.metallic = 0;
  grey.specular = 0;
  scene.materials.push_back(grey);
  Object field;
  field.name = "field";
  field.meshes.push_back(grid(quads_a_side));
  scene.objects.push_back(std::move(field));
  scene.instances.push_back({"field", 0, M44d()});
  scene.environment = Environment();
  scene.cameras.push_back(camera());
  return scene;
}

}  // namespace helio::bench
