// The scene that a shader works on. Include after the block of push constants, which is named `push` and begins with
// `uint64_t scene`, the address of the SceneTables.
#ifndef SCENE_GLSL
#define SCENE_GLSL

#include "base/base.glsl"
#include "tables/scene.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer SceneBuffer {
  SceneTables tables;
};

#define scene SceneBuffer(push.scene).tables

#endif
