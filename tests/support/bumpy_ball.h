// A closed ball with bumps, whose caps are made of slivers: a mesh that is hard on watertightness.
#pragma once

#include <cmath>

#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {

// `rings` x 2 `rings` quads; the radius varies by `bump` of itself, at random. Fronts are inside or outside.
inline TriangleMesh bumpy_ball(const V3f& center, float radius, int rings, float bump, bool inside,
                               std::uint64_t seed) {
  Random random(seed);
  TriangleMesh mesh;
  const int columns = 2 * rings;
  const auto add = [&](double theta, double phi) {
    const double r = radius * (1 + bump * (random.next_double() - 0.5));
    mesh.positions.push_back(center + V3f(float(r * std::sin(theta) * std::cos(phi)), float(r * std::cos(theta)),
                                          float(r * std::sin(theta) * std::sin(phi))));
  };
  add(0, 0);
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < columns; ++j) add(M_PI * i / rings, 2 * M_PI * j / columns);
  }
  add(M_PI, 0);
  const auto at = [&](int i, int j) {
    return i == 0 ? 0u : i == rings ? std::uint32_t(mesh.positions.size() - 1)
                                    : std::uint32_t(1 + (i - 1) * columns + j % columns);
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < columns; ++j) {
      if (i > 0) mesh.indices.insert(mesh.indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rings) mesh.indices.insert(mesh.indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  }
  if (!inside) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  }
  return mesh;
}

}  // namespace helio::test
