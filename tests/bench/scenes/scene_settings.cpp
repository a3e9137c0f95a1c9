#include "tests/bench/scenes/scene_settings.h"

#include <algorithm>

namespace helio::bench {

namespace {

constexpr int kMostSegments = 256;  // of RenderSettings::max_segments for integrators with light paths

}  // namespace

RenderSettings scene_settings(const SceneDescription& scene, const CameraDescription& camera) {
  RenderSettings settings;
  if (scene.hints.max_segments > 0) settings.max_segments = std::min(scene.hints.max_segments, kMostSegments);
  if (scene.hints.roulette_from > 0) settings.roulette_from = scene.hints.roulette_from;
  if (camera.filter) settings.filter = *camera.filter;
  return settings;
}

}  // namespace helio::bench
