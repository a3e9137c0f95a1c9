// What a render scene will take, from the description alone: asked before anything of it is allocated.
#pragma once

#include <cstdint>
#include <span>

#include "renderer/scene/description/scene_description.h"

namespace helio {

struct BuildMemory {
  std::uint64_t description = 0;  // meshes, images other than the environment's, instances
  std::uint64_t instances = 0;    // records and BVH nodes of instances
  std::uint64_t pyramids = 0;     // of mip-mapped textures, at their largest
  std::uint64_t emitters = 0;     // tables of emissive triangles at their largest, while they are built
  std::uint64_t emitter_count = 0;

  std::uint64_t total() const { return description + instances + pyramids + emitters; }
};

// Of the list of instances in the description.
std::uint64_t instance_bytes(const SceneDescription& scene);

// Of lights of `count` emissive primitives, while they are built.
std::uint64_t emitter_bytes(std::uint64_t count);

// Numbers of lights are kept in 28 bits (LightTree).
inline constexpr std::uint64_t kMaxEmitters = std::uint64_t(1) << 28;

// Upper bounds, but for the BVH of the meshes, which limits itself (AccelInput::max_bytes). Sums stop at 2^64 - 1.
// `mip_mapped`: as in TextureOptions.
BuildMemory estimate_build_memory(const SceneDescription& scene, std::span<const TextureSlot> mip_mapped = {});

}  // namespace helio
