#include "renderer/frame/stages/temporal_reprojection.h"

#include "renderer/frame/tile_grid.h"

namespace helio {

void TemporalReprojection::finished(TileGrid& grid) {
  if (complete_) grid.mark_prepared();
}

}  // namespace helio
