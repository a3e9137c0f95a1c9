// The KHR_materials_ extensions that put something on or into the metallic-roughness model.
#pragma once

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

// Reads KHR_materials_clearcoat, _sheen, _anisotropy, _iridescence and _diffuse_transmission of a material. Values
// outside the specification's ranges fail with their place; each extension's textures keep its colour spaces.
void read_material_layers(const JsonObject& material, const Document& document, MaterialLayers& layers);

// `value` of a property that is at least 1; a hair below is a slip and read as 1, less fails with what is `allowed`.
double at_least_one(const JsonObject& object, const char* key, double value, const char* allowed);

}  // namespace helio::gltf
