// The immutable snapshot that rays are traced against: geometry, BVH, materials, textures and lights, rebased so that
// the scene's centre is the origin. Shared by every session that uses it; a camera never changes it.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"
#include "renderer/scene/scene_description.h"
#include "renderer/scene/scene_features.h"
#include "renderer/scene/texture.h"

namespace helio {

enum class RayMode {
  measured,  // without Embree's robust mode where the scene is seen not to leak (SceneFeatures::fast_rays)
  robust,    // always in robust mode
};

struct RenderSceneOptions {
  int threads = 0;                      // for the BVH build; 0: all cores
  RayMode rays = RayMode::measured;
  const CancelToken* cancel = nullptr;  // looked at between and during the stages of the build; null: never
  // Of the textures that tell how surfaces reflect. Emission, alpha and environments are looked up bilinearly always:
  // light sampling and rays that hit a light must find the same there.
  TextureFilter texture_filter = TextureFilter::bilinear;
};

struct RenderSceneStats {
  std::uint64_t triangles = 0;            // unique
  std::uint64_t instanced_triangles = 0;  // as seen by a camera
  std::uint64_t memory_bytes = 0;         // meshes, textures, light tables and BVH
  double build_seconds = 0;
};

class RenderScene {
 public:
  // Takes the description by value: its arrays become the snapshot's. Notices are added to its report.
  // Errors: resource_exhausted (SceneDescription::memory_limit, or more materials or lights than can be numbered),
  // cancelled.
  static Result<std::shared_ptr<const RenderScene>> build(SceneDescription description,
                                                          const RenderSceneOptions& options);
  ~RenderScene();

  const SceneDescription& description() const;
  const SceneFeatures& features() const;
  const RenderSceneStats& stats() const;
  const V3d& origin() const;   // world coordinates of the rebased origin
  Box3d world_bounds() const;  // world coordinates; empty when there is no geometry

  struct Impl;  // trace/scene_data.h
  const Impl& impl() const { return *impl_; }

 private:
  explicit RenderScene(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
