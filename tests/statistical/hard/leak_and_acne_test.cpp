// Hard case 3: closed rooms let no light in and lit surfaces do not shade themselves, in four million camera samples
// that meet a surface at each place and size (rooms: 1.3 million in the short tier). Every single sample is looked at:
// one that leaks or shades itself fails the test.
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/trace/sampling/warp.h"
#include "tests/statistical/hard/placements.h"
#include "tests/support/bumpy_ball.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

constexpr std::uint64_t kLeast = 4'000'000;  // samples on surfaces, of each test at each placement
const int kRoomFilms = by_tier(1, 3);

// A prism along z whose walls meet at 20 degrees on its left and at 80 on its right: a ray that leaves one wall close
// to such an edge starts next to the other.
TriangleMesh wedge() {
  TriangleMesh mesh;
  const double height = 2 * std::tan(20 * M_PI / 180);
  for (const double z : {-1.0, 1.0}) {
    for (const V3d& p : {V3d(-1, -0.3, z), V3d(1, -0.3, z), V3d(1, -0.3 + height, z)})
      mesh.positions.emplace_back(float(p.x), float(p.y), float(p.z));
  }
  mesh.indices = {0, 1, 2, 3, 5, 4, 0, 4, 1, 0, 3, 4, 1, 5, 2, 1, 4, 5, 0, 2, 5, 0, 5, 3};
  return mesh;
}

// Triangles without area, needles and a second copy of the first wall: whatever happens to them, the wall is closed.
void spoil(TriangleMesh& mesh) {
  const auto first = std::vector<std::uint32_t>(mesh.indices.begin(), mesh.indices.begin() + 6);
  mesh.indices.insert(mesh.indices.end(), first.begin(), first.end());
  mesh.indices.insert(mesh.indices.end(), {first[0], first[0], first[1]});
  mesh.indices.insert(mesh.indices.end(), {first[2], first[2], first[2]});
  const V3f a = mesh.positions[first[0]], b = mesh.positions[first[1]];
  const auto base = std::uint32_t(mesh.positions.size());
  mesh.positions.push_back((a + b) * 0.5f);           // on the side a b: no area
  mesh.positions.push_back(a + (b - a) * 0.25f + V3f(1e-6f, 1e-6f, 1e-6f));  // a needle
  mesh.indices.insert(mesh.indices.end(), {first[0], first[1], base, first[0], base + 1, first[1]});
}

class Leak : public testing::TestWithParam<Placement> {};

// A room without a lamp under a sky of a million. Not one of its samples may be anything but black.
TEST_P(Leak, NoneInMillionsOfSamplesOfClosedRooms) {
  const Placement& placement = GetParam();
  struct Room {
    const char* name;
    std::vector<TriangleMesh> meshes;
    V3d eye;
    int films;
  };
  std::uint64_t on_surfaces = 0;
  std::vector<Room> rooms;
  rooms.push_back({"box", {box({-1, -1, -1}, {1, 1, 1}, 0, true), box({-0.4f, -1, -0.3f}, {0.3f, 0.2f, 0.5f}, 0),
                           bumpy_ball({0.3f, 0.5f, -0.4f}, 0.3f, 24, 0, false, 7)}, V3d(-0.7, 0.3, 0.8), kRoomFilms});
  rooms.push_back({"cave", {bumpy_ball({0, 0, 0}, 1, 80, 0.02f, true, 7)}, V3d(0.2, 0.1, -0.1), kRoomFilms});
  rooms.push_back({"wedge", {wedge()}, V3d(0.6, 0, 0.1), kRoomFilms});
  for (Room& room : rooms) {
    spoil(room.meshes[0]);
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0.8f, 0.8f, 0.8f))};
    scene.environment = Environment{};
    scene.environment->radiance = Rgb(1e6f, 1e6f, 1e6f);
    Object object;
    object.meshes = std::move(room.meshes);
    place(scene, std::move(object), placement);
    const auto built = build(std::move(scene));
    ASSERT_TRUE(built);
    EXPECT_EQ(built->features().fast_rays, !placement.instanced) << room.name;
    PathSettings settings;
    settings.max_segments = placement.instanced ? 3 : 4;  // instances cost half as much again
    settings.roulette_from = 100;
    const V3d eye = placement.place(room.eye);
    Random random(11);
    std::uint64_t samples = 0, lit = 0, invalid = 0, missed = 0;
    for (int film = 0; film < room.films; ++film) {
      settings.seed = std::uint64_t(film);
      const V3f way = square_to_sphere(random.next_v2f());
      for_each_camera_sample(*built, camera_at(eye, eye + V3d(way) * placement.scale, 100), 512, 512, kHalves, settings,
                             [&](const HalfPixel& half, const PixelFeatures& features, int) {
                               ++samples;
                               lit += half.sum[0] != 0 || half.sum[1] != 0 || half.sum[2] != 0;
                               invalid += 1 - half.count;
                               missed += features.primitive == ~0u;
                             });
    }
    EXPECT_EQ(samples, std::uint64_t(room.films) * 512 * 512 * 2);
    EXPECT_EQ(lit, 0u) << room.name;
    EXPECT_EQ(invalid, 0u) << room.name;
    EXPECT_EQ(missed, 0u) << room.name;
    on_surfaces += samples - lit - invalid;  // what meets no surface is lit by the sky
  }
  EXPECT_GE(on_surfaces, by_tier(kLeast / 3, kLeast));
}

INSTANTIATE_TEST_SUITE_P(, Leak, testing::ValuesIn(kPlacements),
                         [](const auto& info) { return std::string(info.param.name); });

class Acne : public testing::TestWithParam<Placement> {};

// Convex bodies and a floor of 128 x 128 quads with a second copy of itself in the same plane, in the light of a sun
// that sinks to 89.9 degrees: of a face whose normal is n each sample is albedo / pi x irradiance x max(0, n . l),
// whatever lies beside it. What shades itself is black. A face that looks away can be met where edge dilation makes it
// stand out by 4e-6 radii (ARCHITECTURE.md, "Watertight without robust mode"); those samples are counted apart.
TEST_P(Acne, NoneInFourMillionSamplesOfConvexBodies) {
  const Placement& placement = GetParam();
  TriangleMesh floor;
  for (int copy = 0; copy < 2; ++copy) {
    const auto base = std::uint32_t(floor.positions.size());
    for (int i = 0; i <= 128; ++i) {
      for (int j = 0; j <= 128; ++j) floor.positions.emplace_back(float(i) / 64 - 1, 0.0f, float(j) / 64 - 1);
    }
    for (std::uint32_t i = 0; i < 128; ++i) {
      for (std::uint32_t j = 0; j < 128; ++j) {
        const std::uint32_t at = base + i * 129 + j;
        floor.indices.insert(floor.indices.end(), {at, at + 1, at + 130, at, at + 130, at + 129});
      }
    }
  }
  TriangleMesh tilted = box({-0.7f, -0.6f, -0.5f}, {0.7f, 0.6f, 0.5f}, 0);
  M44d turn;
  turn.setEulerAngles(V3d(0.3, 0.5, 0.7));
  for (V3f& p : tilted.positions) p = V3f(V3d(p) * turn);
  // From above, from the side, grazing: pictures that the body fills as far as it can.
  struct View {
    double height, fov;
    int columns, rows;
  };
  struct Body {
    TriangleMesh mesh;
    std::vector<View> views;
  };
  const Body bodies[] = {
      {floor, {{1.5, 28, 640, 384}, {0.5, 12, 1024, 256}, {0.02, 0.5, 4096, 64}}},
      {tilted, {{1.5, 30, 512, 512}, {0.5, 36, 512, 512}, {0.02, 36, 512, 512}}},
      {bumpy_ball({0, 0, 0}, 1, 60, 0, false, 7), {{1.5, 44, 544, 544}, {0.5, 50, 544, 544}, {0.02, 50, 544, 544}}},
  };
  const double albedo = 0.5, irradiance = 10;
  std::uint64_t on_surfaces = 0;
  for (std::size_t body = 0; body < std::size(bodies); ++body) {
    for (const double zenith : {40.0, 89.9}) {
      const V3d to_light(std::sin(zenith * M_PI / 180), std::cos(zenith * M_PI / 180), 0);
      SceneDescription scene;
      scene.materials = {lambert(Rgb(float(albedo), float(albedo), float(albedo)))};
      PunctualLight sun;
      sun.kind = PunctualKind::directional;
      sun.direction = -to_light;
      sun.intensity = Rgb(float(irradiance), float(irradiance), float(irradiance));
      scene.lights = {sun};
      Object object;
      object.meshes = {bodies[body].mesh};
      place(scene, std::move(object), placement);
      std::vector<double> expected;
      std::vector<V3d> normals, corners;  // in the object's space
      const TriangleMesh& mesh = bodies[body].mesh;
      for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
        V3d p[3];
        for (std::size_t k = 0; k < 3; ++k) p[k] = V3d(mesh.positions[mesh.indices[3 * t + k]]);
        V3d n = normalize(cross(p[1] - p[0], p[2] - p[0]));
        normals.push_back(n);
        corners.push_back(p[0]);
        if (placement.mirrored) n.x = -n.x;
        const double cosine = dot(n, to_light);
        expected.push_back(albedo / M_PI * irradiance * std::max(0.0, cosine));
      }
      const auto built = build(std::move(scene));
      ASSERT_TRUE(built);
      PathSettings settings;
      settings.max_segments = 2;
      Random random(5);
      const V3d target = placement.place(V3d(0, 0, 0));
      std::uint64_t hits = 0, wrong = 0, rims = 0;
      double worst = 0;
      for (const View& view : bodies[body].views) {
        const double angle = random.next_double() * 2 * M_PI;
        const V3d eye(2.2 * std::cos(angle), view.height, 2.2 * std::sin(angle));
        const std::uint64_t hits_before = hits;
        const auto look = [&](const HalfPixel& half, const PixelFeatures& features, int) {
          if (features.primitive == ~0u) return;
          ++hits;
          const std::size_t face = features.primitive;
          if (dot(normals.at(face), eye - corners[face]) <= 0) {
            ++rims;
            return;
          }
          const double error = std::abs(half.sum[0] - expected[face]);
          worst = std::max(worst, error);
          wrong += error > 2e-5 * irradiance || half.count != 1;
        };
        ++settings.seed;
        // Half A alone: only of its samples it is known which face they met.
        for_each_camera_sample(*built, camera_at(placement.place(eye), target, view.fov), view.columns, view.rows, 1,
                               settings, look);
        EXPECT_GT(double(hits - hits_before), 0.7 * view.columns * view.rows) << body << ' ' << view.height;
      }
      EXPECT_LE(rims, placement.instanced ? 0u : 10u) << body << ' ' << zenith;
      EXPECT_EQ(wrong, 0u) << "body " << body << ", zenith " << zenith << ", worst " << worst << " of " << hits;
      on_surfaces += hits - rims;
    }
  }
  EXPECT_GE(on_surfaces, kLeast);
}

INSTANTIATE_TEST_SUITE_P(, Acne, testing::ValuesIn(kPlacements),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace helio::test
