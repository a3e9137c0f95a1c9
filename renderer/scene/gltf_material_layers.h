// The KHR_materials_ extensions that put something on or into the metallic-roughness model.
#pragma once

#include "renderer/scene/gltf_document.h"

namespace helio::gltf {

// Reads KHR_materials_clearcoat, _sheen, _anisotropy, _iridescence and _diffuse_transmission of a material. Values
// outside the specification's ranges fail with their place; each extension's textures keep its colour spaces.
void read_material_layers(const JsonObject& material, const Document& document, MaterialLayers& layers);

}  // namespace helio::gltf
