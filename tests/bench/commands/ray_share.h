// Rays a second of the whole renderer over bare Embree calls on the same rays.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "renderer/trace/scene/render_scene.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

struct RayShareRequest {
  std::string name;  // figures are NAME.ray_share, ...
  std::shared_ptr<const RenderScene> scene;
  int width = 0, height = 0;   // of the picture from the scene's first camera, in pixels
  int samples = 4;             // per pixel; the rays of a million paths take about 200 MB
  std::optional<double> goal = std::nullopt;  // of ray_share
};

// Adds bare seconds over those of the render loop and over those of its kernel alone, and both rates; medians of
// options.repeat, in turns. internal: a run traced other rays than those recorded.
Status add_ray_share(const RayShareRequest& request, RenderEngine& engine, const BenchOptions& options,
                     Figures& figures);

}  // namespace helio::bench
