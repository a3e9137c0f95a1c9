#include "tests/bench/scenes/lamp_hall.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "renderer/base/check.h"
#include "tests/support/random.h"

namespace helio::bench {

namespace {

constexpr float kBay = 4, kBeamWidth = 0.3f, kBeamDepth = 0.6f;  // beams run across the hall, at multiples of kBay in z
constexpr float kPillarSpacing = 8, kPillarSide = 0.5f;
constexpr float kLampDrop = 0.1f;  // of a lamp, below the ceiling
constexpr int kPowers = 32;
// The lamps' total flux over the floor's area; makes the floor's mean radiance about 0.3.
constexpr double kFluxPerArea = 3;

enum HallMaterial { kFloor, kWalls, kCrates };

// From 1 to 1000 in equal ratios.
double power_of(int power) {
  return std::pow(1000.0, power / (kPowers - 1.0));
}

Material diffuse(const Rgb& albedo) {
  Material material;
  material.base_color = albedo;
  material.metallic = 0;
  material.specular = 0;
  return material;
}

void place(SceneDescription& scene, TriangleMesh mesh) {
  Instance instance;
  instance.name = "part " + std::to_string(scene.instances.size());
  instance.object = int(scene.objects.size());
  scene.objects.emplace_back().meshes.push_back(std::move(mesh));
  scene.instances.push_back(std::move(instance));
}

TriangleMesh box(const V3f& low, const V3f& high, int material) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  mesh.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  mesh.material = material;
  return mesh;
}

void add_building(SceneDescription& scene) {
  constexpr float kThick = 0.2f;  // of floor, ceiling and walls
  const float w = kHallWidth, h = kHallHeight, l = kHallLength, t = kThick;
  place(scene, box({-t, -t, -t}, {w + t, 0, l + t}, kFloor));
  place(scene, box({-t, h, -t}, {w + t, h + t, l + t}, kWalls));
  place(scene, box({-t, 0, -t}, {0, h, l + t}, kWalls));
  place(scene, box({w, 0, -t}, {w + t, h, l + t}, kWalls));
  place(scene, box({0, 0, -t}, {w, h, 0}, kWalls));
  place(scene, box({0, 0, l}, {w, h, l + t}, kWalls));
  for (float z = kBay; z < l; z += kBay) {
    place(scene, box({0, h - kBeamDepth, z - kBeamWidth / 2}, {w, h, z + kBeamWidth / 2}, kWalls));
    for (float x = kPillarSpacing / 2; x < w; x += kPillarSpacing) {
      const V3f half(kPillarSide / 2, 0, kPillarSide / 2);
      if (std::fmod(z, kPillarSpacing) == 0)
        place(scene, box(V3f(x, 0, z) - half, V3f(x, h - kBeamDepth, z) + half, kWalls));
      else
        place(scene, box({x + 2, 0, z - 1}, {x + 4, 2, z + 1}, kCrates));
    }
  }
}

// As large as leaves their radiance the same, but for those that would not fit between beams.
float lamp_side(int side) {
  return std::min(8.0f / float(side), 2.4f);
}

// `along`, [0, 1) of the hall's length, moved off the beams.
float lamp_z(float along, float lamp) {
  const float bays = kHallLength / kBay, bay = std::floor(along * bays), inside = along * bays - bay;
  const float margin = kBeamWidth / 2 + lamp;
  return bay * kBay + margin + inside * (kBay - 2 * margin);
}

// The lamps of one power are one mesh.
void add_lamps(SceneDescription& scene, int side) {
  test::Random random(38);
  TriangleMesh lamps[kPowers];
  const float lamp = lamp_side(side), half = lamp / 2;
  double sum = 0;
  for (int i = 0; i < side * side; ++i) {
    const bool one = side == 1;  // behind the camera
    const float u = one ? 0.5f : random.next_float(), v = one ? 0.6f : random.next_float();
    const int power = one ? 0 : int(random.next_u32() % kPowers);
    const float x = lamp + (float(i % side) + u) / float(side) * (kHallWidth - 2 * lamp);
    const float z = lamp_z((float(i / side) + v) / float(side), lamp), y = kHallHeight - kLampDrop;
    TriangleMesh& mesh = lamps[power];
    const auto first = std::uint32_t(mesh.positions.size());
    for (const V2f& corner : {V2f(-half, -half), V2f(half, -half), V2f(half, half), V2f(-half, half)})
      mesh.positions.emplace_back(x + corner.x, y, z + corner.y);
    for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + corner);  // faces down
    sum += power_of(power);
  }
  const double flux = kFluxPerArea * kHallWidth * kHallLength / sum, area = lamp * lamp;
  for (int power = 0; power < kPowers; ++power) {
    if (lamps[power].indices.empty()) continue;
    Material black = diffuse(Rgb(0, 0, 0));
    black.emission = Rgb(float(power_of(power) * flux / (std::numbers::pi * area)));
    lamps[power].material = int(scene.materials.size());
    scene.materials.push_back(black);
    place(scene, std::move(lamps[power]));
  }
}

}  // namespace

SceneDescription lamp_hall(int lamps) {
  HELIO_DCHECK(lamps >= 1 && lamps <= 1 << 20);
  SceneDescription scene;
  scene.name = "hall of lamps";
  scene.materials = {diffuse(Rgb(0.4f, 0.38f, 0.35f)), diffuse(Rgb(0.7f)), diffuse(Rgb(0.5f, 0.3f, 0.15f))};
  add_building(scene);
  add_lamps(scene, int(std::sqrt(double(lamps))));
  // From eye height, a little to the side of the row of pillars, along +z.
  CameraDescription camera;
  camera.vertical_fov = 36 * std::numbers::pi / 180;
  camera.to_world = M44d(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 17.5, 1.8, 50.5, 1);
  scene.cameras = {camera};
  return scene;
}

}  // namespace helio::bench
