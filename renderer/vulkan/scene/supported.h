// The features of a scene that the shaders do not have.
#pragma once

#include <string>
#include <vector>

#include "renderer/trace/scene/render_scene.h"

namespace helio::vulkan {

// What the scene needs and shaders cannot do, in the order of its materials: "material 'paint': clearcoat, sheen" (its
// layers), "material 'wall': a blend within a blend", "mip-mapped textures". Materials that nothing has do not count.
// Empty: the scene can be uploaded.
std::vector<std::string> unsupported(const RenderScene& scene);

}  // namespace helio::vulkan
