// How a material names a texture.
#pragma once

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

// Reads the textureInfo under `key` of a material or one of its parts, with KHR_texture_transform. The slot's image
// indexes Document::images. Not present when the key is absent or the texture has no image that we can read.
TextureSlot read_texture_slot(const JsonObject& owner, const char* key, TexelEncoding encoding,
                              const Document& document);

}  // namespace helio::gltf
