// The lights of a scene as the shaders read them (shaders/tables/lights.h, shaders/lights/light_sampler.glsl).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/images/environment.h"
#include "renderer/trace/lights/light_sampler.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/shaders/tables/lights.h"

namespace helio::vulkan {

// A LightSampler on the host in the layout of the device. Vectors are copies; spans are the sampler's own arrays.
struct HostLights {
  LightTables tables;  // with counts and probabilities, and addresses that are 0
  std::vector<AreaLightTable> areas;
  std::vector<PunctualLightTable> punctual;
  std::vector<ProjectorTable> projectors;
  std::vector<EmitterTable> emitters;
  std::vector<LightAlphaTable> alphas;
  std::vector<TextureSlotTable> slots;     // each once
  std::vector<LightTreeChildTable> nodes;  // kLightTreeWidth a node
  std::span<const AliasTable::Bin> power, infinite;
  std::span<const std::uint32_t> node_places, places;
  std::span<const std::uint32_t> column_cdf, row_cdf;
  std::span<const double> row_cos;
  std::span<const float> density;

  // Bits of kLightFeatures (shaders/lights/light_features.glsl).
  std::uint32_t features() const;
  std::uint64_t bytes() const;  // of device memory, with room for alignment
  // Errors: those of Arena::upload().
  Result<LightTables> place(Arena& arena) const;
};

// `lights` must outlive the result. Everything that LightSampler samples is supported, projectors included.
HostLights make_host_lights(const LightSampler& lights);

}  // namespace helio::vulkan
