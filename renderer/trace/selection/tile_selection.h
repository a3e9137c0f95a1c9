// Which tiles get light paths, from what is known of them (pilot_render.h says by which measure).
#pragma once

#include <vector>

#include "renderer/trace/selection/technique_history.h"

namespace helio {

struct TileSelection {
  std::vector<bool> on;  // by tile: light paths pay
  // Estimates that are off by half would not change it: all tiles are treated alike, and the other way is much worse.
  bool clear = false;
};

// Pure.
TileSelection choose_tiles(const std::vector<TileEstimate>& tiles);

// By what the error of pixels with light paths grows where only this share of the picture's pixels has them, (0, 1]:
// what lands on them comes from all.
double error_of_fewer_light_paths(double share);

}  // namespace helio
