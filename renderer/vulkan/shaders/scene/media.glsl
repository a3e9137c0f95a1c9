// The volumes that a path is inside of, and what they take from the light along a segment: trace/scene/media.h.
#ifndef MEDIA_GLSL
#define MEDIA_GLSL

#include "scene/scene.glsl"
#include "scene/surface_params.glsl"

const uint kMediumDepth = 8;

// The media around a point, innermost last; media within kMediumDepth others are counted, not known.
struct MediumStack {
  uint material[kMediumDepth];
  uint count;
  uint beyond;
};

// Puts the path into a medium; false where that lies within kMediumDepth others.
bool enter_medium(inout MediumStack media, uint material) {
  if (media.count < kMediumDepth) {
    media.material[media.count++] = material;
    return true;
  }
  media.beyond = min(media.beyond + 1, 255);
  return false;
}

void leave_medium(inout MediumStack media, uint material) {
  if (media.beyond > 0) {
    --media.beyond;
    return;
  }
  for (int i = int(media.count) - 1; i >= 0; --i) {
    if (media.material[i] != material) continue;
    for (uint j = uint(i); j + 1 < media.count; ++j) media.material[j] = media.material[j + 1];
    --media.count;
    return;
  }
}

bool cross_surface(inout MediumStack media, uint material, bool from_front) {
  if (from_front) return enter_medium(media, material);
  leave_medium(media, material);
  return true;
}

// Beer's law in one medium, for a distance from 0 to the largest float.
vec3 transmittance(uint material, float distance) {
  const vec3 sigma = material_of(material).absorption;
  return is_black(sigma) ? vec3(1) : exp(-sigma * distance);
}

vec3 transmittance(MediumStack media, float distance) {
  return transmittance(media.material[media.count - 1], distance);
}

// Transmittance along a ray that starts at a surface: that of the innermost medium after the crossing.
vec3 shadow_transmittance(MediumStack media, uint material, bool is_volume, bool front, bool leaves_front,
                          float distance) {
  if (is_volume && leaves_front != front) cross_surface(media, material, front);
  if (media.count == 0) return vec3(1);
  return transmittance(media, is_finite(distance) ? distance : kLargestFloat);
}

#endif
