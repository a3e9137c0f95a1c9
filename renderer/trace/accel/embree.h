// Embree 3.13 and 4 behind one set of names. Included by accel*.cpp, bvh_builder.cpp, traversal_isa.cpp and the ray
// benchmark only.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define HELIO_EMBREE 4
#else
#include <embree3/rtcore.h>
#define HELIO_EMBREE 3
#endif

#include "renderer/trace/accel/accel.h"

namespace helio::embree {

#if HELIO_EMBREE == 4
using Context = RTCRayQueryContext;
inline void init(Context* context) {
  rtcInitRayQueryContext(context);
}
#else
using Context = RTCIntersectContext;
inline void init(Context* context) {
  rtcInitIntersectContext(context);
}
#endif

// One for the process; it owns no threads of its own: builds run in the caller's arena. Null: Embree does not work
// here.
RTCDevice device();

// What filter callbacks see: Embree's context is the first member, so the pointer converts back.
struct AlphaContext {
  Context embree;
  const AlphaTest* test = nullptr;
  const Ray* rays = nullptr;  // indexed by the ray's id
  std::uint32_t flat_count = 0;
  std::uint32_t rest_id = RTC_INVALID_GEOMETRY_ID;  // Accel::Impl::rest_id
};

// `coherent`: Embree's frustum traversal. Embree 3.13 never returns from it for packets that meet both an instance and
// a sphere, so callers ask for it in scenes of top-level triangles only.
inline void intersect16(const int* valid, RTCScene scene, AlphaContext* context, RTCRayHit16* ray_hit, bool coherent) {
#if HELIO_EMBREE == 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context->embree;
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, ray_hit, &arguments);
#else
  context->embree.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect16(valid, scene, &context->embree, ray_hit);
#endif
}

inline void occluded16(const int* valid, RTCScene scene, AlphaContext* context, RTCRay16* ray) {
#if HELIO_EMBREE == 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context->embree;
  rtcOccluded16(valid, scene, ray, &arguments);
#else
  context->embree.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded16(valid, scene, &context->embree, ray);
#endif
}

}  // namespace helio::embree
