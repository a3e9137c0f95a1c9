// A scene as a device will read it, still on the host: tables, BVH, and what its shaders need.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/trace/scene/render_scene.h"
#include "renderer/vulkan/device/device_info.h"
#include "renderer/vulkan/scene/bvh.h"
#include "renderer/vulkan/scene/geometry_tables.h"
#include "renderer/vulkan/scene/light_tables.h"
#include "renderer/vulkan/scene/material_tables.h"
#include "renderer/vulkan/scene/texture_tables.h"

namespace helio::vulkan {

using ShaderFeatures = std::array<std::uint32_t, 4>;  // specialisation constants 0 to 3

struct HostScene {
  std::shared_ptr<const RenderScene> scene;  // which the tables refer to
  SceneGeometry geometry;
  SceneBvh bvh;  // empty for Level::rt
  HostMaterials materials;
  HostLights lights;
  HostTextures textures;
  ShaderFeatures features{};

  std::uint64_t bytes() const;  // of device memory, acceleration structures not counted
};

// Takes as long as a build of the scene. unimplemented: it has what shaders have not (unsupported()), by name;
// resource_exhausted; cancelled.
Result<HostScene> make_host_scene(std::shared_ptr<const RenderScene> scene, Level level, const CancelToken* cancel);

}  // namespace helio::vulkan
