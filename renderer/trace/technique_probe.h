// Where light paths pay: both ways of rendering are tried on a small picture of the same view, and each tile of the
// large one gets the one that makes the whole picture's error smallest for the time.
//
// All pixels get the same number of samples, so a choice of tiles has the error E = sum e_t / n after the time n sum
// c_t, and the best one minimises (sum e_t)(sum c_t) (the efficiency of Grittmann et al. 2022, "Efficiency-Aware
// Multiple Importance Sampling for Bidirectional Rendering Algorithms", eq. 5, with tiles for pixels and one decision,
// not counts). Tiles enter in the order of gain over cost. Errors are relative, (x - r)^2 / (r^2 + 1e-2 mean(r)^2), and
// come from differences of halves. They cannot tell of light that the path tracer finds once in a thousand samples,
// which may be what makes its error: to it is added what it would make of such paths as the bidirectional one has found
// (path_tracer_square()).
//
// The probe's samples are used for nothing else, so the picture stays unbiased. Costs are rays, not seconds, for the
// choice must be the same on every machine.
#pragma once

#include <memory>
#include <vector>

#include "renderer/film/light_tiles.h"
#include "renderer/film/splat_buffer.h"
#include "renderer/trace/camera.h"
#include "renderer/trace/path_integrator.h"

namespace helio {

class TechniqueProbe {
 public:
  // settings.integrator does not matter. Costs about as much as one to two samples of every pixel. Once `cancel` is
  // raised, runs end early, and there is no result.
  TechniqueProbe(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, int width, int height,
                 const PathSettings& settings, std::shared_ptr<const CancelToken> cancel);
  ~TechniqueProbe();

  // SweepPass: parts in any order and by several threads, then finish_sweep(). Bits do not depend on either.
  std::size_t parts() const { return jobs_.size() / kTechniques; }  // of a sweep
  int sweeps() const { return kTechniques; }
  void run(int sweep, std::size_t part);
  void finish_sweep(int sweep);

  // After the sweep.
  const LightTiles& result() const { return tiles_; }

  // Of a tile: mean relative error (square) of a pixel with one sample, and mean rays of a sample.
  struct Estimate {
    double error = 0, cost = 0;
  };
  // Tiles for which light paths pay; `path` and `bdpt` by tile. Pure.
  static std::vector<bool> choose(const std::vector<Estimate>& path, const std::vector<Estimate>& bdpt);

 private:
  static constexpr int kTechniques = 2;  // path, bdpt
  struct Job {
    int technique, half;
    PixelRect window;
  };
  double mean_cost(int technique) const;

  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<const CancelToken> cancel_;
  LightTiles tiles_;
  PixelRect picture_;  // of the small pictures, what the region is in
  int scale_;                           // pixels per pixel of the small pictures
  std::uint32_t samples_[kTechniques];  // of a half
  Camera camera_, splat_camera_;
  PathSettings settings_[kTechniques];
  Film films_[kTechniques];
  SplatBuffer squares_;  // WindowTask::squares
  float rare_ = 0;
  std::vector<Job> jobs_;          // the path tracer's, then as many with light paths
  std::vector<TraceStats> stats_;  // by job
};

}  // namespace helio
