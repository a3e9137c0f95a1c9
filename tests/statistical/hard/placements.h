// The hard places and sizes that a scene may have, and every camera sample of it one by one.
#pragma once

#include <ostream>
#include <string>

#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {

// Where an object of about unit size stands, by the transform of its node.
struct Placement {
  const char* name;
  double scale;
  double shift;               // along x and, negative, along y
  bool mirrored = false;      // x becomes -x
  bool instanced = false;     // placed a second time, out of sight: both stay instances of one bottom level

  M44d to_world() const {
    M44d m;
    m.setScale(V3d(mirrored ? -scale : scale, scale, scale));
    m[3][0] = shift;
    m[3][1] = -shift;
    return m;
  }
  V3d place(const V3d& p) const { return p * to_world(); }
};

inline std::ostream& operator<<(std::ostream& out, const Placement& placement) {
  return out << placement.name;
}

inline constexpr Placement kPlacements[] = {
    {"AsItIs", 1, 0},
    {"ShiftedByTenMillion", 1, 1e7},
    {"OfSizeOneTenThousandth", 1e-4, 0},
    {"OfSizeOneMillion", 1e6, 0},
    {"HundredfoldInstance", 100, 0, false, true},
    {"MirroredInstance", 1, 0, true, true},
    {"ShiftedMirroredInstance", 1, 1e7, true, true},
};

inline void place(SceneDescription& scene, Object object, const Placement& placement) {
  const int index = add_object(scene, std::move(object));
  add_instance(scene, index, placement.to_world());
  if (!placement.instanced) return;
  M44d aside = placement.to_world();
  aside[3][2] += 20 * placement.scale;
  add_instance(scene, index, aside);
}

// Calls visit(half, features, h) for each sample of a film: one sample of each of `halves` in a pixel, so that half.sum
// is that sample. The features are those of half A.
template <class Visit>
void for_each_camera_sample(const RenderScene& scene, const CameraPose& pose, int width, int height, int halves,
                            const PathSettings& settings, const Visit& visit) {
  Film film(width, height);
  const Camera camera(pose, width, height, scene.origin());
  const CancelToken never;
  TraceStats stats;
  for (int h = 0; h < halves; ++h) {
    ASSERT_TRUE(trace_window(scene, camera, settings, {h, 0, 1}, film.bounds(), never, film, stats));
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int h = 0; h < halves; ++h) visit(film.half(h, x, y), film.features(x, y), h);
    }
  }
}

}  // namespace helio::test
