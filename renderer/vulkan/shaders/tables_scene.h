// All that the shaders read of one scene. Made by scene/device_scene.cpp.
#ifndef HELIO_VULKAN_TABLES_SCENE_H
#define HELIO_VULKAN_TABLES_SCENE_H

#include "tables.h"
#include "tables_geometry.h"
#include "tables_lights.h"
#include "tables_materials.h"
#include "tables_textures.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

// What paths of a scene and a picture may need: the specialisation constant kPathFeatures (path.glsl).
HELIO_CONSTANT kPathAbsorption = 1u;  // SceneFeatures::absorption
HELIO_CONSTANT kPathLens = 2u;        // a camera with a lens of a radius above 0
HELIO_CONSTANT kPathFilter = 4u;      // a pixel filter that is not the box

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
