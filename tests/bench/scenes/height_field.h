// A scene of as many triangles as asked for, made in memory: tells how traversal grows with a scene.
#pragma once

#include "renderer/scene/description/scene_description.h"

namespace helio::bench {

// A grid of quads_a_side^2 quads, 2 units wide, lifted by sines of periods down to 1 / 40 unit; grey, under a sky of
// radiance 1, with one camera whose square picture it fills but for a fifth. Precondition: quads_a_side in [1, 20000].
SceneDescription height_field(int quads_a_side);

}  // namespace helio::bench
