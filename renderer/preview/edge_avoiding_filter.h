// Edge-avoiding a-trous filter (Dammertz et al. 2010; guided as SVGF, Schied et al. 2017): light of pixels with few
// samples becomes the mean of that of neighbours on the same surface, each weighed by its samples and by how far noise
// explains that the two differ. Level by level the neighbours lie twice as far away. Other pixels are read and never
// changed.
#pragma once

#include "renderer/preview/preview_history.h"
#include "renderer/trace/camera/camera_projection.h"

namespace helio {

class EdgeAvoidingFilter {
 public:
  // Changes pixels with fewer samples than `limit`. Levels come in pairs: the second of each leaves its result in
  // history.current. The history outlives this.
  EdgeAvoidingFilter(const PreviewView& target, int limit, PreviewHistory& history);

  // Pixels of a window at level 0, 1, ... Thread safe for different windows of one level.
  void run(const PixelRect& window, int level) const;

 private:
  struct Value;
  Value value(std::size_t i, int level) const;
  Rgb around(int x, int y, int level) const;

  PreviewHistory& history_;
  int limit_;
  PixelRect region_;
  CameraProjection here_;
};

}  // namespace helio
