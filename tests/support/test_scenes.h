// Small scenes put together in code, and a renderer loop for tests that look at pixels.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/paths/path_integrator.h"
#include "tests/support/pixel_moments.h"

namespace helio::test {

inline Material lambert(const Rgb& albedo, const Rgb& emission = Rgb(0, 0, 0)) {
  Material m;
  m.base_color = albedo;
  m.emission = emission;
  m.metallic = 0;
  m.specular = 0;
  m.double_sided = true;
  return m;
}

inline Material glass(float ior) {
  Material m;
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.thickness = 1;
  m.ior = ior;
  return m;
}

// Two triangles, counter-clockwise seen from where cross(u, v) points.
inline TriangleMesh quad(const V3f& corner, const V3f& u, const V3f& v, int material) {
  TriangleMesh mesh;
  mesh.positions = {corner, corner + u, corner + u + v, corner + v};
  for (auto& set : mesh.texcoords) set.clear();
  mesh.texcoords[0] = {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  mesh.material = material;
  return mesh;
}

// Axis-aligned box with its fronts outside, or inside.
inline TriangleMesh box(const V3f& low, const V3f& high, int material, bool inside = false) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  mesh.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  if (inside) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  }
  mesh.material = material;
  return mesh;
}

inline int add_object(SceneDescription& scene, Object object) {
  scene.objects.push_back(std::move(object));
  return int(scene.objects.size()) - 1;
}

inline void add_instance(SceneDescription& scene, int object, const M44d& to_world = M44d()) {
  Instance instance;
  instance.name = "instance " + std::to_string(scene.instances.size());
  instance.object = object;
  instance.to_world = to_world;
  scene.instances.push_back(std::move(instance));
}

inline void add_mesh(SceneDescription& scene, TriangleMesh mesh, const M44d& to_world = M44d()) {
  Object object;
  object.meshes.push_back(std::move(mesh));
  add_instance(scene, add_object(scene, std::move(object)), to_world);
}

inline void add_sphere(SceneDescription& scene, const V3f& center, float radius, int material) {
  Object object;
  object.spheres.push_back({center, radius, material});
  add_instance(scene, add_object(scene, std::move(object)));
}

inline std::shared_ptr<const RenderScene> build(SceneDescription scene, const RenderSceneOptions& options = {}) {
  auto result = RenderScene::build(std::move(scene), options);
  if (!result) {
    ADD_FAILURE() << result.error().to_string();
    return nullptr;
  }
  return *result;
}

inline CameraPose camera_at(const V3d& position, const V3d& target, double fov_degrees = 40) {
  return *look_at(position, target,
                  std::abs(target.y - position.y) > 0.99 * length(target - position) ? V3d(0, 0, 1) : V3d(0, 1, 0),
                  fov_degrees * 3.14159265358979 / 180);
}

// Renders `samples` in each half, in one call per half.
inline Film render(const RenderScene& scene, const CameraPose& pose, int width, int height, std::uint32_t samples,
                   const PathSettings& settings = {}, TraceStats* stats = nullptr, const PixelFilter& filter = {}) {
  Film film(width, height);
  const Camera camera(pose, width, height, scene.origin(), filter);
  const CancelToken never;
  TraceStats local;
  for (int half = 0; half < kHalves; ++half) {
    EXPECT_TRUE(
        trace_window(scene, camera, settings, {half, 0, samples}, film.bounds(), never, film, stats ? *stats : local));
  }
  return film;
}

// Mean over all pixels and samples, and the standard error of that mean as independent samples would have it (Sobol
// points do better: a test that allows three of these is lenient, never flaky).
struct MeanEstimate {
  V3d mean{0, 0, 0};
  V3d standard_error{0, 0, 0};
};

inline MeanEstimate mean_of(const Film& film) {
  MeanEstimate e;
  double pixels = 0;
  V3d variance(0, 0, 0);
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const PixelMoments m = moments_of(film, x, y);
      if (m.count == 0) continue;
      pixels += 1;
      e.mean += m.mean;
      variance += m.variance;
    }
  }
  for (int c = 0; c < 3; ++c) {
    e.mean[c] /= pixels;
    e.standard_error[c] = std::sqrt(variance[c]) / pixels;
  }
  return e;
}

inline bool same_bits(const Film& a, const Film& b) {
  if (bool(a.splats()) != bool(b.splats()) || (a.splats() && !(*a.splats() == *b.splats()))) return false;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel &p = a.half(h, x, y), &q = b.half(h, x, y);
        for (int c = 0; c < 3; ++c) {
          if (p.sum[c] != q.sum[c] || p.deviations[c] != q.deviations[c]) return false;
        }
        if (p.count != q.count || a.invalid(h, x, y) != b.invalid(h, x, y)) return false;
      }
      const PixelFeatures &f = a.features(x, y), &g = b.features(x, y);
      for (int c = 0; c < 3; ++c) {
        if (f.albedo[c] != g.albedo[c] || f.normal[c] != g.normal[c]) return false;
      }
      if (f.depth != g.depth || f.primitive != g.primitive) return false;
    }
  }
  return true;
}

}  // namespace helio::test
