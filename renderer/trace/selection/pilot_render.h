// Chooses `path` or `bdpt` for each tile by a pilot render: both integrators render a small picture of the same view,
// and each tile of the large one gets the one that makes the whole picture's error smallest for the time.
//
// All pixels get the same number of samples, so a choice of tiles has the error E = sum e_t / n after the time n sum
// c_t, and the best one minimises (sum e_t)(sum c_t) (the efficiency of Grittmann et al. 2022, "Efficiency-Aware
// Multiple Importance Sampling for Bidirectional Rendering Algorithms", eq. 5, with tiles for pixels and one decision,
// not counts). Tiles enter in the order of gain over cost. Errors are relative, (x - r)^2 / (r^2 + 1e-2 mean(r)^2), r
// being the mean of a tile and its neighbours, or that of a pixel where both techniques show it brighter (a lamp's
// mirror image in a dark tile). They come from differences of halves, with each sample clamped to a multiple of
// the mean, because one brighter sample in so small a picture is chance. The second moment above the clamp is estimated
// from the bidirectional samples for both integrators (rare_squares()), so that light that `path` finds once in a
// thousand samples is accounted for.
//
// The probe's samples are used for nothing else, so the picture stays unbiased. Costs are rays, not seconds, for the
// choice must be the same on every machine.
//
// Tiles whose surfaces earlier views have probed are not probed again; what borders on them is taken to be like them,
// for this view alone.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/film/core/light_tiles.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/selection/technique_history.h"

namespace helio {

class PilotRender {
 public:
  // settings.integrator does not matter. Costs at most half a sample of every pixel that has to be probed, more in
  // pictures of less than 192 rows or columns. Once `cancel` is raised, runs end early, and there is no result. `known`: of this scene and film.
  PilotRender(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, int width, int height,
              const PathSettings& settings, std::shared_ptr<const CancelToken> cancel,
              TechniqueHistory::Views known = {});
  ~PilotRender();

  // As FrameStage has it: parts in any order and by several threads, then finish_sweep(). Bits do not depend on either.
  std::size_t parts() const;  // of the sweep in hand
  int sweeps() const { return kSweeps; }
  void run(int sweep, std::size_t part);
  void finish_sweep(int sweep);

  // There is a result; the sweeps that are left may only better it.
  bool has_result() const { return current_ > kProbeLightPaths; }
  const LightTiles& result() const { return tiles_; }
  // Null: nothing was probed.
  const std::shared_ptr<const ProbedView>& probed() const { return probed_; }
  bool whole() const { return known_.empty(); }  // drew on no earlier view

 private:
  // The last one only where a quarter of the light paths leaves room for doubt.
  enum Sweep { kRecall, kProbePaths, kProbeLightPaths, kProbeMore, kSweeps };
  static constexpr int kTechniques = 2;  // path, bdpt
  struct Job {
    int half;
    PixelRect window;
  };
  void find_unknown();
  double mean_cost(int technique) const;
  std::optional<TileEstimate> estimate(std::size_t tile, double floor) const;
  std::uint32_t first_light_samples() const { return std::max(1u, samples_[1] / 4); }
  void choose();

  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<const CancelToken> cancel_;
  TechniqueHistory::Views known_;
  CameraPose pose_;
  LightTiles tiles_;
  std::shared_ptr<const ProbedView> probed_;
  int current_ = 0;                                     // sweep
  std::vector<std::optional<TileEstimate>> estimates_;  // of the tiles
  std::vector<bool> measured_;                          // tiles that need the pilot render
  PixelRect region_;                                    // of the large picture
  PixelRect picture_;                                   // of the small pictures, what is probed
  int scale_;                                           // pixels per pixel of the small pictures
  std::uint32_t samples_[kTechniques];                  // per pixel and half
  std::uint32_t taken_ = 0;                             // samples of bdpt so far
  bool clear_ = false;                                  // more of them cannot change the choice
  Camera camera_, splat_camera_;
  PathSettings settings_[kTechniques];
  // As large as the film's share of them, once something has to be probed.
  struct Pictures {
    Pictures(int width, int height);
    Film films[kTechniques];
    SplatBuffer squares;  // WindowTask::squares
  };
  std::unique_ptr<Pictures> pictures_;
  float rare_ = 0;
  std::vector<Job> jobs_;                       // of either technique
  std::vector<TraceStats> stats_[kTechniques];  // by job
};

}  // namespace helio
