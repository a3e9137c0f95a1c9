// Asks for the memory that shading a batch of hits will read, before the first of them is shaded: on large scenes each
// hit waits for a few lines of memory, and those of a batch come at once. There are three rounds, because each reads
// what the one before it asked for.
#pragma once

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// Asks for the indices of the corners of the triangle that was hit, where shading reads its corners.
void prefetch_corners(const SceneData& scene, const Hit& hit);
// Asks for the normals, texture coordinates and colours of the corners.
void prefetch_attributes(const SceneData& scene, const Hit& hit);
// Asks for the texels of the base colour, the normal map, and metalness and roughness, at full resolution.
void prefetch_texels(const SceneData& scene, const Hit& hit);

// All rounds, for hits[order[i]], i < count.
void prefetch_hits(const SceneData& scene, const Hit* hits, const std::uint32_t* order, int count);

}  // namespace helio
