// t = 1: a vertex of a light path is joined to the camera.
#pragma once

#include <optional>

#include "renderer/trace/camera/camera_importance.h"
#include "renderer/trace/paths/connection_rays.h"
#include "renderer/trace/paths/light_paths.h"

namespace helio {

struct SplatConnection {
  CameraConnection camera;
  Rgb radiance;       // what its light path alone would make of the pixel's, weighted; if nothing lies between
  double weight = 1;  // which that is
  float share = 0;    // of the vertex's f_cos, what depends on the view (ToldLight); if asked for
  // The sum of (p_j / p)^2 over the path tracer's techniques j, p being this one's density (rare_squares()).
  double path_tracer = 0;
};

// Nothing where the camera sees nothing of the vertex. `lens` as of Camera::generate_ray(). `unweighted`: by no other
// technique. `point`: the vertex as its light sees it; null: not at hand.
std::optional<SplatConnection> connect_to_camera(const SceneData& scene, const CameraImportance& camera,
                                                 const LightVertex& vertex, const ShadingPoint* point,
                                                 const V2f& lens, const TechniqueCounts& counts, bool unweighted,
                                                 bool with_share = false);

// The ray of a connection. Precondition: `rays` is not full. `path` and `key` tell the light path apart.
inline void add_splat_ray(const LightVertex& vertex, const SplatConnection& splat, std::uint32_t key,
                          std::uint32_t reversed_index, std::uint32_t path, ConnectionRays& rays) {
  const CameraConnection& c = splat.camera;
  rays.add_between(vertex.start(c.direction), vertex.surface.position + c.direction * c.distance,
                   combine_hash(key ^ 0x5be0cd19u, reversed_index + std::uint32_t(vertex.depth)), path, splat.radiance);
}

// Where on the lens a vertex of a light path is joined to the camera.
inline V2f lens_sample(const Camera& camera, std::uint32_t key, std::uint32_t reversed_index, int depth) {
  // Pairs of dimensions beyond all others.
  constexpr std::uint32_t kLensPair = 0x40000;
  if (camera.pinhole()) return V2f(0.5f, 0.5f);
  const SamplePair drawn = sample_pair(key, reversed_index, kLensPair + std::uint32_t(depth));
  return V2f(drawn.x, drawn.y);
}

}  // namespace helio
