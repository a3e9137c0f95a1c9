// Embree's side of an Accel, for accel.cpp and for the ray benchmark, which traces the same scenes with bare calls.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/trace/accel.h"
#include "renderer/trace/embree.h"

namespace helio {

struct Accel::Impl {
  RTCScene top = nullptr;
  std::vector<RTCScene> objects;
  const AlphaTest* alpha_test = nullptr;
  bool triangles_only = false;  // no instances, no spheres
  std::size_t memory_bytes = 0;
  float ray_limit = 0;           // rays whose coordinates add up to more are not traced
  float widening_radius = 0;     // as in AccelInput
  std::uint32_t flat_count = 0;  // top-level ids below are flat parts, those above are instances

  ~Impl();
};

}  // namespace helio
