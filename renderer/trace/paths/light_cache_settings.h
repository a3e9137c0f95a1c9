// How camera paths draw on the light vertices of a pass (light_vertex_cache.h).
#pragma once

namespace helio {

struct LightCacheSettings {
  int connections = 2;      // of a camera vertex, to light vertices drawn from all; [1, 64]
  double radius = 0.003;    // within which the first pass merges, of the scene's; [1e-6, 0.1]
  double shrinking = 0.75;  // pass n merges within radius x n^((shrinking - 1) / 2); no setting: tests change it

  bool operator==(const LightCacheSettings&) const = default;
};

}  // namespace helio
