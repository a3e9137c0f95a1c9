// The volumes that a path is inside of, and what they take from the light along a segment.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// Innermost last. The camera is taken to lie outside of all volumes; for lights see enclosing_media.h.
//
// Media that lie within kDepth others are counted, not known: light crosses them as it crosses the innermost that is
// known. They are left before it is, as where volumes are nested.
struct MediumStack {
  static constexpr int kDepth = 8;
  std::array<std::uint16_t, kDepth> material{};
  std::uint8_t count = 0;
  std::uint8_t beyond = 0;  // within those; stops at 255

  void clear() { count = beyond = 0; }
  // False: the medium lies within kDepth others.
  bool enter(std::uint32_t m) {
    if (count < kDepth) {
      material[count++] = std::uint16_t(m);
      return true;
    }
    beyond = std::uint8_t(beyond + (beyond < 255));
    return false;
  }
  // Through the surface of a volume, from its front or from its back. False: into one that lies within kDepth others.
  bool cross(std::uint32_t m, bool from_front) {
    if (from_front) return enter(m);
    leave(m);
    return true;
  }
  void leave(std::uint32_t m) {
    if (beyond > 0) {
      --beyond;
      return;
    }
    for (int i = count - 1; i >= 0; --i) {
      if (material[std::size_t(i)] != std::uint16_t(m)) continue;
      for (int j = i; j + 1 < count; ++j) material[std::size_t(j)] = material[std::size_t(j + 1)];
      --count;
      return;
    }
  }
};

// Beer's law in the innermost medium, which there must be.
inline Rgb transmittance(const SceneData& scene, const MediumStack& media, float distance) {
  const Rgb& sigma = scene.materials[media.material[std::size_t(media.count - 1)]].absorption;
  if (is_black(sigma)) return Rgb(1, 1, 1);
  return Rgb(std::exp(-sigma.x * distance), std::exp(-sigma.y * distance), std::exp(-sigma.z * distance));
}

// Along a ray that starts at the surface: inside the innermost medium after the crossing. `media`: before it, on the
// side from which the path came; `front`: that is the front; `leaves_front`: the ray leaves on the front.
inline Rgb shadow_transmittance(const SceneData& scene, MediumStack media, const PartRecord& part, bool front,
                                bool leaves_front, float distance) {
  if (scene.materials[part.material].volume && leaves_front != front) media.cross(part.material, front);
  if (media.count == 0) return Rgb(1, 1, 1);
  return transmittance(scene, media, std::isfinite(distance) ? distance : std::numeric_limits<float>::max());
}

}  // namespace helio
