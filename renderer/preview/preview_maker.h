// What makes a preview, in sweeps and parts as FrameStage has them: all parts of a sweep, in any order and on any worker,
// then finish_sweep().
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class PreviewMaker {
 public:
  virtual ~PreviewMaker() = default;

  virtual int sweeps() const = 0;         // as far as they are known
  virtual std::size_t parts() const = 0;  // of the sweep that comes next
  virtual void run(int sweep, std::size_t part, TraceStats& stats) = 0;
  virtual void finish_sweep(int sweep) = 0;

  // The picture of a window inside the region, linear radiance, row-major. After the last sweep, until the history's
  // next preview begins. Thread safe.
  virtual void resolve(const PixelRect& window, std::vector<float> (&display)[3]) const = 0;
};

}  // namespace helio
