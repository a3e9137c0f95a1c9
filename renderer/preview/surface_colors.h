// The colour that a surface's light is divided by before it is looked up elsewhere and multiplied with there, so that
// lookups blur light and not textures. Any positive function of the surface will do: this one is the base colour where
// a texture or vertex colours make it vary, else white.
//
// A point of a texture that is smaller than a pixel tells little of what the pixel shows: towards such, the texture's
// mean takes over.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

class SurfaceColors {
 public:
  explicit SurfaceColors(const RenderScene& scene);

  bool varies(std::uint32_t material) const { return materials_[material].varies; }
  // What was worked out for the triangle before, which neighbours often share.
  struct Recent {
    const PartRecord* part = nullptr;
    std::uint32_t primitive = kNoHit, instance = kNoHit;
    float uv_per_length = 0;
  };
  // `footprint`: side of a pixel on the surface, scene units. Precondition: varies(the surface's material).
  Rgb at(const Hit& hit, const Surface& surface, float footprint, Recent& recent) const;

 private:
  struct OfMaterial {
    bool varies = false;
    TextureSlot texture, nearest;          // absent: vertex colours alone | without interpolation
    Rgb base{1, 1, 1}, mean{1, 1, 1};      // factor | of the texture
    float texels = 0;                      // along a side of the texture: root of their number
  };

  const SceneData& scene_;  // the caller keeps it alive
  std::vector<OfMaterial> materials_;
};

}  // namespace helio
