// Motion vectors of a picture's pixel centres: the places at which the picture before showed the same surfaces.
#pragma once

#include <vector>

#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

struct FilmPositions {
  // Pixels from the film's upper left corner, of each pixel, row-major; NaN: it was not seen.
  std::vector<float> x, y;
};

// For a film of width x height pixels, from the view `before` to the view `now`, both fitted(). A point was seen where
// its surface was: the centre of that pixel met the same instance, no nearer than by a pixel's side or a hundredth of
// its distance. What lies behind mirrors and glass is not followed. Seconds of one thread for millions of pixels.
FilmPositions previous_positions(const RenderScene& scene, const CameraPose& before, const CameraPose& now, int width,
                                 int height);

}  // namespace helio
