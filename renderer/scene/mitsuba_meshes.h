// Mesh files: Wavefront OBJ, PLY (ascii and binary) and Mitsuba's own serialized format.
//
// The parsers are pure functions of the bytes. Sizes are checked against what the file holds before memory is taken;
// indices are checked against the vertices. Polygons become fans. Errors, without `where`: invalid_argument with line
// or byte, resource_exhausted.
#pragma once

#include <span>

#include "renderer/scene/memory_budget.h"
#include "renderer/scene/scene_description.h"

namespace helio::mitsuba {

Result<TriangleMesh> parse_obj(std::span<const std::uint8_t> bytes, MemoryBudget& budget);
Result<TriangleMesh> parse_ply(std::span<const std::uint8_t> bytes, MemoryBudget& budget);
// Formats 3 and 4. shape_index counts from 0.
Result<TriangleMesh> parse_serialized(std::span<const std::uint8_t> bytes, int shape_index, MemoryBudget& budget);

// What every mesh goes through: indices in range, finite positions, normals of unit length (all or none), colours
// in [0, 1] (all or none). Meshes may hold triangles without area.
Status check_mesh(TriangleMesh& mesh);

// Normals of vertices as the mean of their triangles' normals weighted by angle (Thuermer and Wuethrich 1998).
void add_vertex_normals(TriangleMesh& mesh);

}  // namespace helio::mitsuba
