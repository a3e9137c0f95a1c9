// Scenes and rays that put tracers to the test.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "renderer/trace/sampling/warp.h"
#include "renderer/trace/scene/surface.h"
#include "tests/support/bumpy_ball.h"
#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {

inline M44d placed(const V3d& scale, const V3d& turn, const V3d& at) {
  M44d m;
  m.setScale(scale);
  M44d rotation, translation;
  rotation.setEulerAngles(turn);
  translation.setTranslation(at);
  return m * rotation * translation;
}

// Materials of mixed_scene().
enum { kOpaque, kMask, kBlend, kTexturedMask, kVertexBlend };

inline std::vector<Material> alpha_materials() {
  std::vector<Material> materials(5, lambert(Rgb(0.5f, 0.5f, 0.5f)));
  materials[kMask].alpha_mode = AlphaMode::mask;
  materials[kMask].base_alpha = 0.4f;  // below the cutoff: not there
  materials[kBlend].alpha_mode = AlphaMode::blend;
  materials[kBlend].base_alpha = 0.6f;
  materials[kTexturedMask].alpha_mode = AlphaMode::mask;
  materials[kTexturedMask].base_color_texture.image = 0;
  materials[kTexturedMask].base_color_texture.filter = FilterMode::nearest;
  materials[kTexturedMask].base_color_texture.wrap_u = WrapMode::mirror;
  materials[kVertexBlend].alpha_mode = AlphaMode::blend;
  return materials;
}

inline Image checkered() {
  Image image;
  image.name = "checkered";
  image.width = image.height = 8;
  image.channels = 4;
  image.texels.assign(4 * 64, 255);
  for (std::size_t i = 0; i < 64; ++i) image.texels[4 * i + 3] = (i ^ i / 8) & 1 ? 255 : 0;
  return image;
}

// A closed room of half size 4 around the origin with everything in it that a ray can meet: flat triangles and spheres,
// instances with both, turned, stretched and mirrored, and all kinds of alpha. `scale` multiplies all coordinates.
inline SceneDescription mixed_scene(float scale) {
  SceneDescription scene;
  scene.materials = alpha_materials();
  scene.images = {checkered()};
  const auto at = [scale](float x, float y, float z) { return V3f(x, y, z) * scale; };
  add_mesh(scene, box(at(-4, -4, -4), at(4, 4, 4), kOpaque, true));
  add_mesh(scene, bumpy_ball(at(2, -2, 1), scale, 24, 0.1f, false, 1));
  add_sphere(scene, at(-2, -2.5f, 0), 1.2f * scale, kOpaque);
  add_sphere(scene, at(-2, 2, 1), 0.9f * scale, kBlend);
  add_sphere(scene, at(2.5f, 2.2f, -1), 0.8f * scale, kTexturedMask);
  add_mesh(scene, quad(at(-3, 0.5f, -2), at(2, 0, 0), at(0, 2, 1), kTexturedMask));
  add_mesh(scene, quad(at(-3, -3, -3), at(6, 0, 0), at(0, 6, 0), kBlend));
  add_mesh(scene, quad(at(-1, 2, -3.5f), at(3, 0, 0), at(0, 1, 0.2f), kMask));
  TriangleMesh faded = quad(at(0, -1, 3), at(3, 0, 0), at(0, 3, 0.4f), kVertexBlend);
  faded.colors = {V4f(1, 1, 1, 0), V4f(1, 1, 1, 1), V4f(1, 1, 1, 0.5f), V4f(1, 1, 1, 0.9f)};
  add_mesh(scene, faded);

  Object object;
  object.meshes = {bumpy_ball(V3f(0, 0, 0), 0.5f * scale, 8, 0.2f, false, 2),
                   quad(at(-1, -0.2f, -1), at(2, 0, 0), at(0, 0, 2), kTexturedMask),
                   quad(at(-1, 0.3f, -1), at(2, 0, 0), at(0, 0, 2), kBlend)};
  object.spheres = {{at(0.9f, 0.4f, 0), 0.3f * scale, kOpaque}, {at(-0.9f, 0.4f, 0), 0.35f * scale, kBlend}};
  const int shared = add_object(scene, object);
  add_instance(scene, shared, placed(V3d(1), V3d(0), V3d(0, 0, 0)));
  add_instance(scene, shared, placed(V3d(-0.7, 0.7, 0.7), V3d(0.4, 1.1, 0), V3d(0, 2.5, 0) * double(scale)));
  add_instance(scene, shared, placed(V3d(1.5, 0.4, 0.8), V3d(0.3, 0.2, 2), V3d(0, -2.6, 2) * double(scale)));
  add_instance(scene, shared, placed(V3d(0.02), V3d(1, 2, 3), V3d(3, 0, 2) * double(scale)));
  Object ball;
  ball.spheres = {{V3f(0, 0, 0), 0.4f * scale, kOpaque}};
  const int spheres = add_object(scene, ball);
  add_instance(scene, spheres, placed(V3d(1), V3d(0), V3d(3, -3, -2) * double(scale)));
  add_instance(scene, spheres, placed(V3d(2, 1, -1), V3d(0.5, 0, 0), V3d(-3, 0, 3) * double(scale)));
  return scene;
}

// From anywhere in the room in any direction; every fourth ray ends somewhere.
inline std::vector<Ray> random_rays(int count, float scale, std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const V2f xy = random.next_v2f();
    const V3f origin = V3f(8 * xy.x - 4, 8 * xy.y - 4, 8 * random.next_float() - 4) * (0.99f * scale);
    const float t_max = i % 4 == 0 ? 6 * random.next_float() * scale : std::numeric_limits<float>::infinity();
    const V3f direction = square_to_sphere(random.next_v2f());
    rays.push_back({origin, t_max, direction, random.next_u32()});
  }
  return rays;
}

// From a camera outside or inside of the room, row by row.
inline std::vector<Ray> camera_rays(int size, const V3f& eye, const V3f& target) {
  const V3f forward = normalize(target - eye), right = normalize(cross(forward, V3f(0.1f, 1, 0)));
  const V3f up = cross(right, forward);
  std::vector<Ray> rays;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float u = 2 * (float(x) + 0.5f) / float(size) - 1, v = 1 - 2 * (float(y) + 0.5f) / float(size);
      const V3f direction = normalize(forward + (right * u + up * v) * 0.7f);
      rays.push_back({eye, std::numeric_limits<float>::infinity(), direction, std::uint32_t(rays.size())});
    }
  }
  return rays;
}

// Rays that leave the hits of others: every second one grazes its surface.
inline std::vector<Ray> bounced_rays(const SceneData& scene, const std::vector<Ray>& rays, const std::vector<Hit>& hits,
                                     std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> bounced;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    const Surface surface = make_surface<true>(scene, rays[i], hits[i]);
    const V3f normal = surface.facing_normal(), any = square_to_sphere(random.next_v2f());
    const float rise = i % 2 == 0 ? 1.0001f : 1e-4f;
    const V3f along = any - normal * dot(any, normal);
    const V3f direction = normalize(i % 2 == 0 ? any + normal * rise : normalize_any(along) + normal * rise);
    Ray ray{offset_origin(surface, rays[i].direction, direction), std::numeric_limits<float>::infinity(), direction,
            random.next_u32()};
    if (i % 8 == 0) ray.t_max = scene.radius * random.next_float();
    bounced.push_back(ray);
  }
  return bounced;
}

}  // namespace helio::test
