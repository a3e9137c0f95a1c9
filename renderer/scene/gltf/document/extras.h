// extras.heliograph: what glTF itself cannot say. The schema is documented in scenes/README.md.
#pragma once

#include <optional>

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

// On the asset or the chosen scene (which wins): environment {radiance, image, rotation}.
void read_environment_extras(const JsonObject& root, Document& document);
// On a node: sphere {radius, center, material}.
std::optional<Sphere> read_sphere_extras(const JsonObject& node, const Document& document);
// On a material: conductor {eta, k}, distribution, alpha.
void read_material_extras(const JsonObject& object, Material& material);
// On a camera: lens_radius, focus_distance.
void read_camera_extras(const JsonObject& object, CameraDescription& camera);

}  // namespace helio::gltf
