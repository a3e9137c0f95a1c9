// What a dispatch is asked for, and what it answers: structs of path.glsl and tracer.cpp.
#ifndef HELIO_VULKAN_TABLES_TASK_H
#define HELIO_VULKAN_TABLES_TASK_H

#include "base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

HELIO_CONSTANT kCameraOrthographic = 1u;
HELIO_CONSTANT kCameraLens = 2u;  // a lens of a radius above 0

// Camera (trace/camera/camera.h) with its pixel filter.
struct CameraTable {
  double step_x[3], step_y[3], corner[3];
  double filter_scale;
  uint64_t filter_density, filter_integral;  // double[kFilterPieces + 1] each, of the Gaussian; 0: another filter
  vec3 origin, forward, right, up;
  float lens_radius, focus_distance;
  uint flags;
  uint filter_kind;  // PixelFilterKind
  int width, height;
};

// Samples [first_sample, first_sample + samples) of one half of each pixel of a window. The answers lie at
// (row-major pixel of the window) * samples + (index - first_sample).
struct PathTask {
  CameraTable camera;
  uint64_t answers;         // PathAnswer[]
  uint64_t first_hits;      // FirstHitAnswer[]; 0: nobody asks
  int x0, y0, width, height;
  uint film_half, first_sample, samples;
  uint first_thread, end_thread;  // of the answers, those that this dispatch makes
  uint seed_low, seed_high;
  uint max_segments, roulette_from, roulette_rule;
  uint loop_probe;    // kLoopProbe
  uint probe_result;  // of hash32(), applied so many times to 1
};

// Loops of this many rounds tell whether loops still run to their end (path.glsl).
HELIO_CONSTANT kLoopProbe = 4u;
HELIO_CONSTANT kUnfinished = 0xffffffffu;  // PathAnswer::rays of a sample whose loops were ended by the driver

// Radiance of one sample; NaN where the sample is invalid.
struct PathAnswer {
  vec3 radiance;
  uint rays;             // shadow rays included; or kUnfinished
  uint shadow_rays;
  uint media_overflows;  // TraceStats
};

// A FirstHit (trace/paths/path_group.h) as shaders write it.
struct FirstHitAnswer {
  vec3 albedo, normal;
  float depth;
  uint primitive;
};

#ifdef __cplusplus
static_assert(sizeof(CameraTable) == 168);
static_assert(sizeof(PathTask) == 248);
static_assert(sizeof(PathAnswer) == 24);
static_assert(sizeof(FirstHitAnswer) == 32);
}  // namespace helio::vulkan
#endif

#endif
