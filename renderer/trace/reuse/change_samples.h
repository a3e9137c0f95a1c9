// What an edit has changed in a picture beyond the surfaces that it changed themselves: shadows, reflections, bounced
// light. Measured by paths that are traced in both scenes with the same random numbers: where nothing on their way was
// changed their difference is none.
//
// The picture is cut into square cells; each gets one sample of each half, somewhere in it, in both scenes: 4 / side^2
// of the paths of a frame of one sample per pixel.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/history/change_bound.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

class ChangeSamples {
 public:
  // settings.seed: of none of the picture's own samples. The camera is a pinhole; the region lies in the film of
  // width x height and is not empty. side: of a cell, in pixels, >= 1.
  ChangeSamples(std::shared_ptr<const RenderScene> before, std::shared_ptr<const RenderScene> after,
                const CameraPose& pose, int width, int height, const PixelRect& region, int side,
                const PathSettings& settings);

  // Parts are thread safe; all of trace() come before any of collect(), and finish() after those.
  std::size_t trace_parts() const { return kHalves * windows_.size(); }
  void trace(std::size_t part, TraceStats& stats);
  std::size_t collect_parts() const { return windows_.size(); }
  void collect(std::size_t part);
  void finish() { bound_.finish(); }

  // That a pixel of the region lies in.
  int cell(int x, int y) const { return row(y) * columns_ + column(x); }
  // Bound on the square of what a pixel of the cell may have changed by (film/history/change_bound.h).
  double squared(int cell) const { return bound_.squared(cell % columns_, cell / columns_); }

 private:
  int column(int x) const { return (2 * x + 1 + margin_x_) / (2 * side_); }
  int row(int y) const { return (2 * y + 1 + margin_y_) / (2 * side_); }

  std::shared_ptr<const RenderScene> scenes_[2];  // before, after
  PathSettings settings_;
  int side_, columns_, rows_;
  int margin_x_, margin_y_;         // pixels by which the cells reach beyond the film, both edges together
  CameraPose pose_;                 // that sees just the cells
  std::unique_ptr<Film> films_[2];  // a pixel per cell
  std::vector<PixelRect> windows_;
  ChangeBound bound_;
};

}  // namespace helio
