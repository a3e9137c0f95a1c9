// The picture in a projector's light: projected() of trace/lights/projector.cpp. Include after scene.glsl.
#ifndef PROJECTOR_GLSL
#define PROJECTOR_GLSL

#include "base/base.glsl"
#include "tables/lights.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer ProjectorTables {
  ProjectorTable at[];
};

// Where a direction meets the picture.
struct PictureHit {
  uint slot;  // of the picture, or kNone
  vec2 uv;
  float spread;  // factor on the light that a point source sends along the direction; 0: beside the picture
};

PictureHit hit_picture(uint number, vec3 direction) {
  const ProjectorTable projector = ProjectorTables(scene.lights.projectors).at[number];
  const float z = dot(projector.depth, direction), cosine = dot(projector.axis, direction);
  PictureHit hit = PictureHit(projector.slot, vec2(0), 0);
  if (z > 0 && cosine > 0) {
    hit.uv = vec2(0.5 + dot(projector.across, direction) / z, 0.5 + dot(projector.down, direction) / z);
    const bool inside = hit.uv.x >= 0 && hit.uv.x <= 1 && hit.uv.y >= 0 && hit.uv.y <= 1;
    hit.spread = inside ? 1 / (z * z * cosine) : 0.0;
  }
  return hit;
}

#endif
