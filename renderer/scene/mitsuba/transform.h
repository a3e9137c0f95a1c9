// <transform> elements: translate, rotate, scale, matrix and lookat, applied in the order they are written.
#pragma once

#include <optional>

#include "renderer/scene/mitsuba/document.h"

namespace helio::mitsuba {

// x, y, z attributes (each may be missing: `missing`), or value="x, y, z" or value="x"; none when not finite numbers.
std::optional<V3d> vector_of(const Element& element, double missing);

// Row vectors. Degenerate or malformed steps are reported; the identity stands for them.
M44d read_transform(const Element& element, Diagnostics& diagnostics);

bool mirrors(const M44d& to_world);

// Mitsuba's cameras look along +z with +x to the left; ours along -z with +x to the right.
M44d camera_to_world(const M44d& mitsuba_to_world);

// uv_transform of TextureSlot (u' = m0 u + m1 v + m2, ...) from a to_uv transform.
std::array<float, 6> uv_rows(const M44d& to_uv);

}  // namespace helio::mitsuba
