// The immutable snapshot that rays are traced against: geometry, BVH, materials, textures and lights, rebased so that
// the scene's centre is the origin. Shared by every session that uses it; a camera never changes it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/images/texture.h"
#include "renderer/scene/load/scene_features.h"

namespace helio {

enum class RayMode {
  measured,  // without Embree's robust mode where the scene is seen not to leak (SceneFeatures::fast_rays)
  robust,    // always in robust mode
};

struct RenderSceneOptions {
  int threads = 0;  // for the BVH build; 0: all cores
  RayMode rays = RayMode::measured;
  const CancelToken* cancel = nullptr;  // looked at between and during the stages of the build; null: never
  // Ledger that the build charges for its allocations; the charge stays with it. The description may be in it already.
  // Null: none.
  MemoryLedger* ledger = nullptr;
  // For textures that tell how surfaces reflect. Emission, alpha and environments are looked up bilinearly always:
  // light sampling and rays that hit a light must find the same there.
  TextureFilter texture_filter = TextureFilter::bilinear;
};

struct RenderSceneStats {
  std::uint64_t triangles = 0;            // unique
  std::uint64_t instanced_triangles = 0;  // as seen by a camera
  std::uint64_t meshes = 0, images = 0;
  std::uint64_t memory_bytes = 0;  // meshes, textures, light tables and BVH
  std::uint64_t own_bytes = 0;     // of them, not shared with the scene that this one was edited from
  double build_seconds = 0;
};

// Memory that snapshots may share; `what` is the same for all that do, and keeps it from being freed.
struct MemoryShare {
  std::shared_ptr<const void> what;
  std::uint64_t bytes = 0;
};

class RenderScene;

// What an edit changed, and so all that a picture of the scene before can differ in.
struct EditSummary {
  std::weak_ptr<const RenderScene> parent;  // the scene that was edited; gone once nobody uses it
  std::vector<std::uint32_t> materials;     // whose colour or roughness differs
  std::vector<std::uint32_t> emissions;     // materials whose emission differs: light sampling differs everywhere
  std::vector<std::uint32_t> lights;        // punctual lights
  bool environment = false;
  // An object that was moved, and the boxes in world space that it left and entered.
  struct Move {
    std::uint32_t instance = 0;
    Box3d from, to;
  };
  std::vector<Move> moves;
  bool shares_bvh = false;  // nothing was moved: the whole BVH is the parent's

  bool lighting_changed() const { return !emissions.empty() || !lights.empty() || environment; }
};

class RenderScene {
 public:
  // Takes the description by value: its arrays become the snapshot's. Notices are added to its report.
  // Errors: resource_exhausted (SceneDescription::memory_limit, or more materials or lights than can be numbered),
  // cancelled.
  static Result<std::shared_ptr<const RenderScene>> build(SceneDescription description,
                                                          const RenderSceneOptions& options);
  ~RenderScene();

  // Without objects and images, which edited scenes share: stats() counts them.
  const SceneDescription& description() const;
  const SceneFeatures& features() const;
  const RenderSceneStats& stats() const;
  const V3d& origin() const;                // world coordinates of the rebased origin
  Box3d world_bounds() const;               // world coordinates; empty when there is no geometry
  const EditSummary* edit() const;          // null: loaded, not edited
  std::vector<MemoryShare> memory() const;  // adds up to stats().memory_bytes

  struct Impl;  // trace/scene/scene_data.h
  const Impl& impl() const { return *impl_; }

 private:
  friend class SceneEditor;  // trace/scene/edit_scene.cpp
  explicit RenderScene(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
