// All that the shaders read of one scene. Made by scene/device_scene.cpp.
#ifndef HELIO_VULKAN_TABLES_SCENE_H
#define HELIO_VULKAN_TABLES_SCENE_H

#include "base.h"
#include "geometry.h"
#include "lights.h"
#include "materials.h"
#include "textures.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

// What paths of a scene may need: the specialisation constant kPathFeatures (path.glsl).
HELIO_CONSTANT kPathAbsorption = 1u;  // SceneFeatures::absorption

struct SceneTables {
  GeometryTables geometry;
  LightTables lights;
  TextureTables textures;
  uint64_t materials;  // MaterialTable[]
  float radius;        // SceneData::radius
  uint padding;
};

#ifdef __cplusplus
}  // namespace helio::vulkan
#endif

#endif
