// A primitive's arrays, whatever they were stored as, and the triangle mesh made of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/gltf/accessors.h"

namespace helio::gltf {

// Joints that move a vertex; up to four per set, sets one after the other per vertex.
struct SkinBinding {
  std::size_t per_vertex = 0;  // 4 * number of sets
  std::vector<std::uint32_t> joints;
  std::vector<float> weights;  // of each vertex: sum 1, or all 0 where the file has none
};

struct PrimitiveGeometry {
  TriangleMesh mesh;  // material is Primitive::material and may be -1
  SkinBinding skin;   // empty unless asked for
};

// Reads one primitive. Empty result without failure: nothing in it that has triangles (a warning says so).
// Normals and tangents are made unit, bad ones replaced or dropped with a warning; colours are clamped to [0, 1].
// `weights` are the morph weights (empty or all zero: the base shape); with_skin fills the binding, whose joints are
// below joint_count. Failures go to `diagnostics` and name the primitive or the accessor.
std::optional<PrimitiveGeometry> read_primitive(const Primitive& primitive, const std::string& place,
                                                std::span<const float> weights, std::optional<std::size_t> joint_count,
                                                const BufferStore& buffers, AccessorReader& reader,
                                                Diagnostics& diagnostics);

}  // namespace helio::gltf
