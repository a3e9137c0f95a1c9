// Embree's side of an Accel, for accel.cpp and for the ray benchmark, which traces the same scenes with bare calls.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/trace/accel/accel.h"
#include "renderer/trace/accel/embree.h"

namespace helio {

// The parts of an Accel are shared between those of a scene and of its edits.

// Geometries of the flat parts; they may belong to several scenes.
struct FlatGeometry {
  std::vector<AccelPart> parts;
  std::vector<RTCGeometry> geometries;  // by part
  float edge_dilation_radius = 0;
  std::size_t bytes = 0;  // of the widened corners

  FlatGeometry() = default;
  FlatGeometry(const FlatGeometry&) = delete;
  ~FlatGeometry();
};

// Scenes that were built together.
struct AccelScenes {
  std::vector<RTCScene> scenes;
  std::size_t bytes = 0;

  AccelScenes() = default;
  AccelScenes(const AccelScenes&) = delete;
  ~AccelScenes();
};

struct Accel::Impl {
  RTCScene top = nullptr;  // owned by top_level
  std::shared_ptr<const AccelScenes> top_level;
  std::shared_ptr<const FlatGeometry> flat;
  std::shared_ptr<const FlatGeometry> widened;  // as built, where an edit has put robust ones in its place; else null
  std::vector<std::shared_ptr<const AccelScenes>> objects;
  // After an edit the flat parts that are left are a bottom level; null: they are in the top level.
  std::shared_ptr<const AccelScenes> rest;
  std::vector<bool> taken_out;  // by flat part; empty: none
  const AlphaTest* alpha_test = nullptr;
  bool triangles_only = false;                      // no instances, no spheres
  float ray_limit = 0;                              // rays whose coordinates add up to more are not traced
  float edge_dilation_radius = 0;                   // as in AccelInput
  std::uint32_t flat_count = 0;                     // top-level ids below are flat parts, those above are instances
  std::uint32_t rest_id = RTC_INVALID_GEOMETRY_ID;  // top-level id of `rest`, which is no instance to anybody else

  std::uint32_t instance(std::uint32_t top_level_id) const {
    return top_level_id == RTC_INVALID_GEOMETRY_ID || top_level_id == rest_id ? kNoHit : top_level_id - flat_count;
  }
  std::vector<RTCScene> object_scenes() const;
};

}  // namespace helio
