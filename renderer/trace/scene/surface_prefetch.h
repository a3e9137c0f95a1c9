// What shading hits will read, asked for a batch ahead: on large scenes each hit waits for a few lines of memory, and
// those of a batch come at once. In three rounds, for each reads what the one before it asked for.
#pragma once

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// Of the triangles: the indices of their corners.
void prefetch_corners(const SceneData& scene, const Hit& hit);
// Of the corners: normals, texture coordinates, colours.
void prefetch_attributes(const SceneData& scene, const Hit& hit);
// The texels that the material looks up first.
void prefetch_texels(const SceneData& scene, const Hit& hit);

}  // namespace helio
