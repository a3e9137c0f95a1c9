// Visibility with rays for some pixels, against rays for all.
#include "renderer/preview/sparse_surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "renderer/preview/preview.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 200, kHeight = 150;
constexpr PixelRect kAll{0, 0, kWidth, kHeight};
const CameraPose kHome = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 70);

// Previews without time for samples: what they find of surfaces.
class Surfaces {
 public:
  explicit Surfaces(std::shared_ptr<const RenderScene> scene)
      : scene_(std::move(scene)), history_(std::make_shared<PreviewHistory>(kWidth, kHeight)) {}

  const PreviewHistory& look(const CameraPose& camera, bool upscaling, const GazeDensity* density = nullptr,
                             const PixelRect& region = kAll) {
    PreviewTarget target;
    target.scene = scene_;
    target.camera = camera;
    target.region = region;
    target.until_s = -1;
    target.upscaling = upscaling;
    if (density) target.density = *density;
    Preview preview(history_, target, std::make_shared<CancelToken>());
    rays = 0;
    for (int sweep = 0; sweep < preview.sweeps(); ++sweep) {
      TraceStats stats;
      for (std::size_t part = 0; part < preview.parts(); ++part) preview.run(sweep, part, stats);
      preview.finish_sweep(sweep);
      if (sweep < 2) rays += stats.rays;  // colours and surfaces; fresh samples come after
    }
    return *history_;
  }
  std::uint64_t rays = 0;

 private:
  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<PreviewHistory> history_;
};

// Shares of the window's pixels.
struct Difference {
  double surface = 0, depth = 0, color = 0;
};
Difference difference(const PreviewHistory& a, const PreviewHistory& b, const PixelRect& window = kAll) {
  Difference d;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = a.index(x, y);
      const PreviewPixel &p = a.last.pixels[i], &q = b.last.pixels[i];
      if (p.surface != q.surface) {
        ++d.surface;
      } else if (p.hit() && std::fabs(p.depth - q.depth) > kDepthSlack * q.depth) {
        ++d.depth;
      }
      for (int shift = 0; shift < 24; shift += 8) {
        if (std::abs(int(a.colors[i] >> shift & 255) - int(b.colors[i] >> shift & 255)) > 6) {
          ++d.color;
          break;
        }
      }
    }
  }
  const double pixels = double(window.area());
  return {d.surface / pixels, d.depth / pixels, d.color / pixels};
}

SceneDescription colored_room() {
  SceneDescription scene = lambert_room();
  // Vertex colours that change across each wall.
  for (Object& object : scene.objects) {
    for (TriangleMesh& mesh : object.meshes) {
      if (mesh.material != 0) continue;
      for (const V3f& p : mesh.positions)
        mesh.colors.push_back({0.5f + 0.4f * p.x, 0.5f + 0.4f * p.y, 0.5f + 0.4f * p.z, 1});
    }
  }
  return scene;
}

TEST(SparseSurfaces, UpscaledOnesAreThoseOfARayAPixel) {
  for (const SceneDescription& description : {lambert_room(), colored_room(), mixed_scene()}) {
    const auto scene = build(description);
    Surfaces all(scene), sparse(scene);
    const PreviewHistory& expected = all.look(kHome, false);
    const PreviewHistory& found = sparse.look(kHome, true);
    const Difference d = difference(found, expected);
    EXPECT_LT(d.surface, 0.002);
    EXPECT_LT(d.depth, 0.002);
    EXPECT_LT(d.color, 0.01);
    EXPECT_EQ(all.rays, std::uint64_t(kAll.area()));
    EXPECT_LT(double(sparse.rays), 0.6 * double(kAll.area()));
  }
}

// Two faces of one mesh that look the same way, one behind the other.
TEST(SparseSurfaces, AStepIsNoSlope) {
  SceneDescription description = lambert_room();
  TriangleMesh& mesh = description.objects[0].meshes[0];
  mesh.normals.clear();
  for (const float side : {-1.0f, 1.0f}) {
    const auto first = std::uint32_t(mesh.positions.size());
    const float z = side < 0 ? -0.3f : -0.34f;
    for (const V2f& corner : {V2f(0, -0.5f), V2f(0.6f * side, -0.5f), V2f(0.6f * side, 0.5f), V2f(0, 0.5f)}) {
      mesh.positions.push_back({corner.x, corner.y, z});
      if (!mesh.texcoords[0].empty()) mesh.texcoords[0].push_back({0, 0});
    }
    for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + corner);
  }
  const auto scene = build(description);
  Surfaces all(scene), sparse(scene);
  const PreviewHistory& expected = all.look(kHome, false);
  const Difference d = difference(sparse.look(kHome, true), expected);
  EXPECT_LT(d.surface + d.depth, 0.0005);
  EXPECT_LT(double(sparse.rays), 0.6 * double(kAll.area()));
}

TEST(SparseSurfaces, CamerasOfAllKindsAndRegionsDoLikewise) {
  const auto scene = build(lambert_room());
  CameraPose flat = kHome;
  flat.projection = Projection::orthographic;
  flat.half_height = 0.9;
  for (const CameraPose& camera : {kHome, flat}) {
    for (const PixelRect& region : {kAll, PixelRect{17, 9, 18, 140}, PixelRect{3, 77, 199, 78}, PixelRect{50, 50, 51, 51},
                                    PixelRect{101, 33, 164, 70}}) {
      Surfaces all(scene), sparse(scene);
      const PreviewHistory& expected = all.look(camera, false, nullptr, region);
      const Difference d = difference(sparse.look(camera, true, nullptr, region), expected, region);
      EXPECT_LT(d.surface + d.depth, 0.004) << region.x0;
      // Lattice points around a window are traced for it alone.
      EXPECT_LE(double(sparse.rays), 1.1 * double(region.area()) + 8);
    }
  }
}

// Every pixel has a ray of its own in turn: after four previews at rest colours are those of a ray a pixel.
TEST(SparseSurfaces, ARestFindsEveryColor) {
  SceneDescription description = lambert_room();
  Image checks;
  checks.name = "checks";
  checks.width = checks.height = 16;
  checks.channels = 1;
  for (int i = 0; i < 16 * 16; ++i) checks.texels.push_back((i + i / 16) % 2 ? 250 : 40);
  description.images.push_back(std::move(checks));
  description.materials[0].base_color_texture.image = 0;
  description.materials[0].base_color_texture.filter = FilterMode::nearest;
  for (Object& object : description.objects) {
    for (TriangleMesh& mesh : object.meshes) {
      for (const V3f& p : mesh.positions) mesh.texcoords[0].push_back({p.x + p.z, p.y - p.z});
    }
  }
  const auto scene = build(description);
  Surfaces all(scene), sparse(scene);
  const PreviewHistory& expected = all.look(kHome, false);
  const double first = difference(sparse.look(kHome, true), expected).color;
  for (int k = 0; k < 3; ++k) sparse.look(kHome, true);
  const double fourth = difference(sparse.look(kHome, true), expected).color;
  EXPECT_GT(first, 0.02) << "the texture is no test";
  EXPECT_LT(fourth, 0.1 * first);
}

// A wire of half a pixel's width, met by some lattices and not by others.
TEST(SparseSurfaces, WhatIsThinStays) {
  SceneDescription description = lambert_room();
  description.materials.push_back(lambert(Rgb(0.1f, 0.1f, 0.9f)));
  add_mesh(description, box({-0.9f, 0.0f, -0.401f}, {0.9f, 0.012f, -0.4f}, 2));
  const auto scene = build(description);
  Surfaces all(scene), sparse(scene);
  const auto wire_pixels = [](const PreviewHistory& a, const PreviewHistory& b) {
    return difference(a, b, {20, 40, 180, 75}).surface;
  };
  for (int k = 0; k < 5; ++k) sparse.look(kHome, true);
  for (int k = 0; k < 6; ++k) {
    const CameraPose moved = turned_and_shifted(kHome, 0.15 * k, 0);
    EXPECT_LT(wire_pixels(sparse.look(moved, true), all.look(moved, false)), 0.004) << k;
  }
}

// Blocks of 2x2 and 4x4 pixels away from a gaze.
TEST(CoarseSurfaces, AtTheGazeEveryPixelHasARay) {
  const auto scene = build(colored_room());
  const GazeDensity density({40, 30}, kHeight, 3);
  Surfaces all(scene), coarse(scene);
  const PreviewHistory& expected = all.look(kHome, false);
  const PreviewHistory& found = coarse.look(kHome, false, &density);
  const Difference there = difference(found, expected, {20, 10, 60, 50});
  EXPECT_EQ(there.surface + there.depth + there.color, 0);
  const Difference far = difference(found, expected, {kWidth - 48, kHeight - 48, kWidth, kHeight});
  EXPECT_LT(far.surface, 0.08);
  EXPECT_GT(far.depth, 0);
  EXPECT_LT(double(coarse.rays), 0.6 * double(kAll.area()));
  // With upscaling the pixels at the gaze have fewer rays as well.
  const std::uint64_t rays = coarse.rays;
  const Difference upscaled = difference(coarse.look(kHome, true, &density), expected, {20, 10, 60, 50});
  EXPECT_LT(upscaled.surface + upscaled.depth, 0.01);
  EXPECT_LT(coarse.rays, rays);
  // Whatever the region, and wherever the gaze.
  for (const Gaze& gaze : {Gaze{-1e6, 3}, Gaze{kWidth, kHeight}}) {
    for (const PixelRect& region : {PixelRect{0, 0, 1, 1}, PixelRect{33, 7, 34, 90}, PixelRect{5, 9, 118, 77}}) {
      const GazeDensity other(gaze, kHeight, 2);
      Surfaces fresh(scene);
      fresh.look(kHome, false, &other, region);
      EXPECT_LE(fresh.rays, std::uint64_t(region.area()));
      EXPECT_GT(fresh.rays, 0u);
    }
  }
}

}  // namespace
}  // namespace helio::test
