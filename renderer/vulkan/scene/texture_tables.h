// Images and texture slots as the shaders read them (shaders/tables/textures.h, shaders/scene/textures.glsl).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/shaders/tables/textures.h"

namespace helio::vulkan {

// The slot as the shaders read it; its image is kNone where `slot` is absent.
TextureSlotTable make_texture_slot(const TextureSlot& slot);

// The images of a scene on the host: sizes and formats, without the addresses that their texels will have.
struct HostTextures {
  std::vector<ImageTable> images;
  std::vector<std::span<const std::byte>> texels;  // by image; not copied
  std::vector<std::string> names;                  // by image, for errors
  std::vector<float> srgb_u8, srgb_u16;            // linear values of sRGB-encoded codes; the second may be empty

  // Bits of kLightFeatures (shaders/lights/light_features.glsl).
  std::uint32_t features() const;
  std::uint64_t bytes() const;  // of device memory, with room for alignment
  // Errors: those of Arena::upload(), which name the image.
  Result<TextureTables> place(Arena& arena) const;
};

// `images` must outlive the result.
HostTextures make_host_textures(std::span<const Image> images);

}  // namespace helio::vulkan
