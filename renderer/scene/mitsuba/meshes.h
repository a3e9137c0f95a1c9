// Mesh files: Wavefront OBJ, PLY (ascii and binary) and Mitsuba's own serialized format.
//
// The parsers are pure functions of the bytes. Sizes are checked against what the file holds before memory is taken;
// indices are checked against the vertices. Polygons become fans. Errors, without `where`: invalid_argument with line
// or byte, resource_exhausted.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "renderer/scene/description/memory_budget.h"
#include "renderer/scene/description/scene_description.h"

namespace helio::mitsuba {

Result<TriangleMesh> parse_obj(std::span<const std::uint8_t> bytes, MemoryBudget& budget);
// Colours are those of the attribute, as Mitsuba names it: "vertex_color" is r, g and b of the vertices, "vertex_NAME"
// their NAME_0 to NAME_2 (or _x to _z, _1 to _3), "vertex_NAME_color" their NAME_r to NAME_b; likewise "face_...", of
// which every triangle's colour goes to `face_colors`. An attribute of one value is grey. Absent: no colours.
Result<TriangleMesh> parse_ply(std::span<const std::uint8_t> bytes, MemoryBudget& budget,
                               const std::string& attribute = {}, std::vector<V4f>* face_colors = nullptr);
// Formats 3 and 4. shape_index counts from 0.
Result<TriangleMesh> parse_serialized(std::span<const std::uint8_t> bytes, int shape_index, MemoryBudget& budget);

// What every mesh goes through: indices in range, finite positions, normals of unit length (all or none), colours
// in [0, 1] (all or none). Corners whose normal has no direction get a vertex of their own with their triangle's
// normal. Meshes may hold triangles without area.
Status check_mesh(TriangleMesh& mesh, MemoryBudget& budget);

// Gives every triangle three vertices of its own in its colour, which must lie in [0, 1]. Errors: invalid_argument,
// resource_exhausted.
Status color_faces(TriangleMesh& mesh, const std::vector<V4f>& colors, MemoryBudget& budget);

// Normals of vertices as the mean of their triangles' normals weighted by angle (Thuermer and Wuethrich 1998).
void add_vertex_normals(TriangleMesh& mesh);

}  // namespace helio::mitsuba
