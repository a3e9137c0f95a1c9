#include "renderer/trace/paths/enclosing_media.h"

#include <memory>

#include "renderer/base/check.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

namespace {

struct Walk {
  Ray ray;
  std::uint32_t start;  // of which ray
  MediumStack entered;  // on the way
  MediumStack left;     // without having entered: the innermost first
};

bool contains(const MediumStack& media, std::uint32_t material) {
  for (int i = 0; i < media.count; ++i) {
    if (media.material[std::size_t(i)] == std::uint16_t(material)) return true;
  }
  return false;
}

void cross(Walk& walk, std::uint32_t material, bool from_front) {
  if (from_front)
    walk.entered.enter(material);
  else if (walk.entered.beyond > 0 || contains(walk.entered, material))
    walk.entered.leave(material);
  else
    walk.left.enter(material);
}

// Those beyond are the outermost, which the ray leaves last.
MediumStack outermost_first(const MediumStack& media) {
  MediumStack turned;
  for (int i = media.count - 1; i >= 0; --i) turned.enter(media.material[std::size_t(i)]);
  return turned;
}

}  // namespace

void find_enclosing_media(const SceneData& scene, const Ray* rays, const std::uint32_t* order, std::size_t count,
                          MediumStack* media, TraceStats& stats) {
  HELIO_DCHECK(count <= kMostEnclosed);
  struct Walks {
    Walk walk[kMostEnclosed];
    Ray rays[kMostEnclosed];
    Hit hits[kMostEnclosed];
    std::uint32_t active[kMostEnclosed];
  };
  static thread_local const std::unique_ptr<Walks> walks(new Walks);
  Walks& w = *walks;
  std::size_t active = count;
  for (std::size_t j = 0; j < count; ++j) {
    w.walk[j] = {rays[order[j]], order[j], {}, {}};
    w.active[j] = std::uint32_t(j);
  }
  for (int round = 0; round < kMostBoundaries && active > 0; ++round) {
    for (std::size_t j = 0; j < active; ++j) w.rays[w.active[j]] = w.walk[w.active[j]].ray;
    scene.accel->intersect(w.rays, w.active, active, w.hits, RayOrder::scattered);
    stats.rays += active;
    std::size_t left = 0;
    for (std::size_t j = 0; j < active; ++j) {
      const std::uint32_t i = w.active[j];
      if (!w.hits[i].valid()) continue;
      Walk& walk = w.walk[i];
      const Surface surface = make_surface<true>(scene, walk.ray, w.hits[i]);
      if (surface.material->volume) cross(walk, surface.part->material, surface.front);
      walk.ray.origin = offset_origin(surface, walk.ray.direction, walk.ray.direction);
      w.active[left++] = i;
    }
    active = left;
  }
  for (std::size_t j = 0; j < count; ++j) {
    const Walk& walk = w.walk[j];
    media[walk.start] = outermost_first(walk.left);
    stats.media_overflows += walk.left.beyond;
  }
}

}  // namespace helio
