// What paths carry, and a group of them in flight: see path_kernel_base.h.
#pragma once

#include <cstdint>

#include "renderer/trace/paths/lambert_batch.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/media.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

inline constexpr int kGroupPaths = kPathGroupSize * kPathGroupSize;

struct PathState {
  Rgb beta;     // throughput from the camera to this vertex
  float pdf_w;  // of the direction that was sampled last; 0: camera ray or delta, no other technique finds it
  Rgb radiance;
  float eta_scale;  // product of squared relative iors, taken out of the throughput for roulette
  V3f normal;       // what the light sampler was told at the last vertex
  std::uint32_t key;
  MediumStack media;
};

struct FirstHit {
  Rgb albedo;
  V3f normal;
  float depth;
  std::uint32_t primitive;

  void add_to(PixelFeatures& features, bool is_first_sample) const {
    features.add(albedo, normal, primitive != kNoHit);
    if (!is_first_sample) return;
    features.depth = depth;
    features.primitive = primitive;
  }
};

// A group in flight. Small enough for the second-level cache.
struct PathGroup {
  Ray rays[kGroupPaths];
  Hit hits[kGroupPaths];
  PathState paths[kGroupPaths];
  RayCone cones[kGroupPaths];  // where textures are mip-mapped
  FirstHit first[kGroupPaths];
  std::uint32_t active[kGroupPaths];  // paths that go on, in order
  Ray shadow_rays[kGroupPaths];
  Rgb shadow_radiance[kGroupPaths];
  std::uint32_t shadow_path[kGroupPaths];
  std::uint8_t occluded[kGroupPaths];
  std::uint32_t keys[kGroupPaths];
  float light_x[kGroupPaths], light_y[kGroupPaths], bsdf_x[kGroupPaths], bsdf_y[kGroupPaths];
  float local_x[kGroupPaths], local_y[kGroupPaths], local_z[kGroupPaths];  // wi of Lambert surfaces
  float select[kGroupPaths], lobe[kGroupPaths], roulette[kGroupPaths];
  int pixel_x[kGroupPaths], pixel_y[kGroupPaths];
  LambertBatch batch;  // plain kernel
  int count = 0;       // paths: pixels of the block that lie on the film
};

}  // namespace helio
