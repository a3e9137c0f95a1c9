// A second estimator of the same light transport: paths that go where the BSDF sends them and count what they run into.
//
// No next-event estimation, no multiple importance sampling, no Russian roulette, no groups or halves, independent
// random numbers in the place of Sobol points. Of the renderer it uses what it cannot judge then: geometry, materials,
// BSDF sampling and the camera's rays. What it tells is that light sampling, its densities, the weights, roulette and
// the kernels around them do not change the mean.
#pragma once

#include <cstdint>

#include "renderer/trace/scene/render_scene.h"
#include "tests/statistical/z_test.h"

namespace helio {
struct CameraPose;
}

namespace helio::test {

struct BsdfOnlySettings {
  int max_segments = 10;      // as PathSettings::max_segments
  std::uint32_t samples = 0;  // a pixel, >= 2
  std::uint64_t seed = 0;
  int threads = 2;
};

// Whether such paths can find all the light of a scene that this tracer can trace: no point, spot or directional
// lights, no media that absorb.
bool suits_bsdf_only(const SceneFeatures& features);

// The same bits for any number of threads. Precondition: suits_bsdf_only().
Estimate trace_bsdf_only(const RenderScene& scene, const CameraPose& pose, int width, int height,
                         const BsdfOnlySettings& settings);

}  // namespace helio::test
