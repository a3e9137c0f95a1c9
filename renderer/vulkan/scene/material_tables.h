// Materials as the shaders read them (shaders/tables/materials.h, shaders/scene/evaluate_material.glsl, shaders/bsdf).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/shaders/tables/materials.h"

namespace helio::vulkan {

// Addresses of the tables that LobeParams refer to.
struct BsdfTables {
  std::uint64_t albedo_ggx = 0, albedo_beckmann = 0;  // AlbedoTable

  // Uploads both tables, whatever materials a scene has. Errors: those of Arena::upload().
  static Result<BsdfTables> place(Arena& arena);
};
inline constexpr std::uint64_t kBsdfTableBytes = 2 * (sizeof(AlbedoTable) + 16);

PlasticTable make_plastic_table(const PlasticInterface& interface);

// The lobes of a material of any model but stack; of a blend, what it has besides its parts. `plastic`: address of the
// PlasticTable, 0 for other models.
LobeParams make_lobe_params(const SurfaceParams& params, const BsdfTables& tables, std::uint64_t plastic);

// The materials of a scene on the host.
struct HostMaterials {
  struct Entry {
    MaterialTable table;                              // without `params`
    SurfaceParams params;                             // of the MaterialRecord
    std::shared_ptr<const PlasticInterface> plastic;  // null: another model
  };
  std::vector<Entry> entries;  // by material

  std::uint64_t bytes() const;  // of device memory, with room for alignment
  // The address of an array of MaterialTable. Errors: those of Arena::upload().
  Result<std::uint64_t> place(Arena& arena) const;
};

// `records`: make_material_record() of `materials`.
HostMaterials make_host_materials(const std::vector<Material>& materials, const std::vector<MaterialRecord>& records);

// For each material, whether a shape of the scene has it, itself or in a blend.
std::vector<bool> used_materials(const SceneData& data);

// Bits kLobe... and kFeature... that shaders for the used materials need (kMaterialFeatures of
// shaders/scene/surface_params.glsl).
std::uint32_t material_features(const SceneData& data);

}  // namespace helio::vulkan
