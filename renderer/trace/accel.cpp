#include "renderer/trace/accel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>

#include "renderer/trace/accel_impl.h"
#include "renderer/trace/build_arena.h"

namespace helio {
namespace {

using embree::AlphaContext;

constexpr int kLanes = 16;

// One Embree device for the process; it owns no threads of its own: builds run in the caller's arena.
std::atomic<std::ptrdiff_t> g_device_bytes{0};

// What they may come to; beyond, Embree ends the build that asks for more.
std::atomic<std::ptrdiff_t> g_device_limit{std::numeric_limits<std::ptrdiff_t>::max()};

bool count_bytes(void*, ssize_t bytes, bool allocated) {
  if (bytes > 0 && !allocated && bytes > g_device_limit - g_device_bytes) return false;
  g_device_bytes += bytes;
  return true;
}

bool go_on(void* cancel, double) {
  return !static_cast<const CancelToken*>(cancel)->cancelled();
}

RTCDevice device() {
  static const RTCDevice instance = [] {
    RTCDevice created = rtcNewDevice("start_threads=0,set_affinity=0");
    if (created) rtcSetDeviceMemoryMonitorFunction(created, count_bytes, nullptr);
    return created;
  }();
  return instance;
}

Error build_error(RTCError error, std::size_t max_bytes) {
  if (error == RTC_ERROR_CANCELLED) return {ErrorCode::cancelled, "the build was cancelled", {}};
  if (error == RTC_ERROR_OUT_OF_MEMORY) {
    return {ErrorCode::resource_exhausted,
            "building the BVH needs more memory than the " + std::to_string(max_bytes) + " bytes that are left for it",
            {}};
  }
  return {ErrorCode::resource_exhausted, "building the BVH failed: Embree error " + std::to_string(int(error)), {}};
}

void alpha_filter(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = reinterpret_cast<const AlphaContext*>(arguments->context);
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] == 0) continue;
    const Ray& ray = context->rays[RTCRayN_id(arguments->ray, n, i)];
    const std::uint32_t instance = RTCHitN_instID(arguments->hit, n, i, 0);
    AlphaHit hit;
    hit.part = RTCHitN_geomID(arguments->hit, n, i);
    hit.instance = instance == RTC_INVALID_GEOMETRY_ID ? kNoHit : instance - context->flat_count;
    hit.primitive = RTCHitN_primID(arguments->hit, n, i);
    hit.u = RTCHitN_u(arguments->hit, n, i);
    hit.v = RTCHitN_v(arguments->hit, n, i);
    hit.normal =
        V3f(RTCHitN_Ng_x(arguments->hit, n, i), RTCHitN_Ng_y(arguments->hit, n, i), RTCHitN_Ng_z(arguments->hit, n, i));
    // Inside an instance both the normal and the ray are those of the object's space.
    const V3f direction(RTCRayN_dir_x(arguments->ray, n, i), RTCRayN_dir_y(arguments->ray, n, i),
                        RTCRayN_dir_z(arguments->ray, n, i));
    hit.front = dot(hit.normal, direction) < 0;
    hit.alpha_key = ray.alpha_key;
    const bool opaque = context->test->opaque_at(hit);
    if (!opaque) arguments->valid[i] = 0;
  }
}

// Corners of its own for every triangle, in memory of Embree's, which counts it. False when there is none left.
bool set_widened_buffers(RTCGeometry geometry, const AccelPart& part, double margin) {
  const std::size_t corners = 3 * part.triangle_count;
  auto* positions = static_cast<V3f*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(V3f), corners));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), part.triangle_count));
  if (!positions || !indices) return false;
  constexpr std::size_t kGrain = 16384;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.triangle_count, kGrain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t t = range.begin(); t < range.end(); ++t) {
                        V3f triangle[3];
                        for (std::size_t k = 0; k < 3; ++k) triangle[k] = part.positions[part.indices[3 * t + k]];
                        widen_triangle(triangle, margin);
                        for (std::size_t k = 0; k < 3; ++k) {
                          positions[3 * t + k] = triangle[k];
                          indices[3 * t + k] = std::uint32_t(3 * t + k);
                        }
                      }
                    });
  return true;
}

// Null when memory runs out. Surfaces with alpha are not widened: both triangles of a seam would take from a ray what
// one of them lets pass, and rays that slip through what lets rays through do no harm.
RTCGeometry make_geometry(const AccelPart& part, double margin) {
  RTCGeometry geometry = nullptr;
  if (part.kind == AccelPart::Kind::triangles && margin > 0 && !part.alpha) {
    geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!set_widened_buffers(geometry, part, margin)) {
      rtcReleaseGeometry(geometry);
      return nullptr;
    }
  } else if (part.kind == AccelPart::Kind::triangles) {
    geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, part.positions, 0, sizeof(V3f),
                               part.vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, part.indices, 0,
                               3 * sizeof(std::uint32_t), part.triangle_count);
  } else {
    geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* sphere = static_cast<V4f*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof(V4f), 1));
    *sphere = part.sphere;
  }
  if (part.alpha) {
    rtcSetGeometryIntersectFilterFunction(geometry, alpha_filter);
    rtcSetGeometryOccludedFilterFunction(geometry, alpha_filter);
  }
  rtcCommitGeometry(geometry);
  return geometry;
}

RTCScene make_scene(const AccelInput& input) {
  RTCScene scene = rtcNewScene(device());
  rtcSetSceneFlags(scene, input.widening_radius > 0 ? RTC_SCENE_FLAG_NONE : RTC_SCENE_FLAG_ROBUST);
  if (input.cancel) rtcSetSceneProgressMonitorFunction(scene, go_on, const_cast<CancelToken*>(input.cancel));
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

// Stops where memory runs out; Embree keeps the error.
void attach_parts(RTCScene scene, const std::vector<AccelPart>& parts, double margin = 0) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    RTCGeometry geometry = make_geometry(parts[i], margin);
    if (!geometry) return;
    rtcAttachGeometryByID(scene, geometry, unsigned(i));
    rtcReleaseGeometry(geometry);
  }
}

// Instances share the id space of the top level with the flat parts; they follow them.
void attach_instances(RTCScene scene, const AccelInput& input, const std::vector<RTCScene>& objects) {
  for (std::size_t i = 0; i < input.instances.size(); ++i) {
    RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, objects[input.instances[i].object]);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, input.instances[i].to_world);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, unsigned(input.flat.size() + i));
    rtcReleaseGeometry(geometry);
  }
}

// Embree takes coordinates up to 1.8e18; with assertions, as distributions build it, it ends the process at others.
constexpr double kMaxRayReach = 1e18;

// The reach up to which a ray is in range inside the instance too: a point p becomes inverse * (p - translation) there.
double ray_limit(const AccelInstance& instance) {
  const float* m = instance.to_world;
  const V3d x(m[0], m[1], m[2]), y(m[3], m[4], m[5]), z(m[6], m[7], m[8]);
  const double determinant = std::abs(dot(x, cross(y, z)));
  const double largest = std::max({length(cross(y, z)), length(cross(z, x)), length(cross(x, y))}) / determinant;
  const double offset = std::abs(double(m[9])) + std::abs(double(m[10])) + std::abs(double(m[11]));
  const double limit = kMaxRayReach / largest - offset;
  return limit > 0 ? limit : 0;  // 0 for NaN too
}

}  // namespace

Accel::Impl::~Impl() {
  if (top) rtcReleaseScene(top);
  for (RTCScene object : objects) rtcReleaseScene(object);
}

Accel::Accel(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Accel::~Accel() = default;

Result<std::unique_ptr<Accel>> Accel::build(const AccelInput& input) {
  if (!device()) return Error{ErrorCode::internal, "Embree cannot create a device", {}};
  auto impl = std::make_unique<Impl>();
  impl->alpha_test = input.alpha_test;
  impl->flat_count = std::uint32_t(input.flat.size());
  impl->triangles_only = input.instances.empty();
  for (const AccelPart& part : input.flat) {
    if (part.kind != AccelPart::Kind::triangles) impl->triangles_only = false;
  }
  double limit = kMaxRayReach;
  for (const AccelInstance& instance : input.instances) limit = std::min(limit, ray_limit(instance));
  impl->ray_limit = float(limit);
  impl->widening_radius = input.widening_radius;
  RTCError error = RTC_ERROR_NONE;  // Embree keeps one for each thread
  const auto build = [&] {
    rtcGetDeviceError(device());
    for (const AccelObject& object : input.objects) {
      if (input.cancel && input.cancel->cancelled()) return;
      RTCScene scene = make_scene(input);
      impl->objects.push_back(scene);
      attach_parts(scene, object.parts);
      rtcCommitScene(scene);
    }
    impl->top = make_scene(input);
    attach_parts(impl->top, input.flat, double(input.widening_radius) * double(input.widening));
    attach_instances(impl->top, input, impl->objects);
    rtcCommitScene(impl->top);
    error = rtcGetDeviceError(device());
  };
  // One build at a time: builds use every core by themselves, and the memory monitor counts for the whole device.
  static std::mutex build_mutex;
  const std::lock_guard lock(build_mutex);
  const std::ptrdiff_t bytes_before = g_device_bytes, no_limit = std::numeric_limits<std::ptrdiff_t>::max();
  const auto max_bytes = std::ptrdiff_t(std::min(input.max_bytes, std::size_t(no_limit)));
  g_device_limit = max_bytes < no_limit - bytes_before ? bytes_before + max_bytes : no_limit;
  tbb::task_arena arena(build_concurrency(input.threads));
  arena.execute(build);
  g_device_limit = no_limit;
  if (input.cancel && input.cancel->cancelled()) return build_error(RTC_ERROR_CANCELLED, input.max_bytes);
  if (error != RTC_ERROR_NONE) return build_error(error, input.max_bytes);
  impl->memory_bytes = std::size_t(std::max<std::ptrdiff_t>(0, g_device_bytes - bytes_before));
  return std::unique_ptr<Accel>(new Accel(std::move(impl)));
}

std::size_t Accel::memory_bytes() const {
  return impl_->memory_bytes;
}

const char* Accel::version() {
  return "Embree " RTC_VERSION_STRING;
}

Box3f Accel::bounds() const {
  RTCBounds b;
  rtcGetSceneBounds(impl_->top, &b);
  return Box3f(V3f(b.lower_x, b.lower_y, b.lower_z), V3f(b.upper_x, b.upper_y, b.upper_z));
}

// ---- queries -------------------------------------------------------------------------------------------------------

namespace {

AlphaContext make_context(const Accel::Impl& impl, const Ray* rays) {
  AlphaContext context;
  embree::init(&context.embree);
  context.test = impl.alpha_test;
  context.rays = rays;
  context.flat_count = impl.flat_count;
  return context;
}

void store_hit(const Accel::Impl& impl, Hit& out, float t, float u, float v, float nx, float ny, float nz,
               unsigned geometry, unsigned primitive, unsigned instance) {
  out.t = t;
  out.u = u;
  out.v = v;
  out.normal = V3f(nx, ny, nz);
  out.part = geometry;  // RTC_INVALID_GEOMETRY_ID == kNoHit
  out.primitive = primitive;
  out.instance = instance == RTC_INVALID_GEOMETRY_ID ? kNoHit : instance - impl.flat_count;
}

void fill_lane(RTCRay16& out, int lane, const Ray& ray, unsigned id) {
  out.org_x[lane] = ray.origin.x;
  out.org_y[lane] = ray.origin.y;
  out.org_z[lane] = ray.origin.z;
  out.tnear[lane] = 0;
  out.dir_x[lane] = ray.direction.x;
  out.dir_y[lane] = ray.direction.y;
  out.dir_z[lane] = ray.direction.z;
  out.time[lane] = 0;
  out.tfar[lane] = ray.t_max;
  out.mask[lane] = ~0u;
  out.id[lane] = id;
  out.flags[lane] = 0;
}

// Lanes from `used` on are off; they hold the first ray, so that no lane is uninitialised.
int lanes_of(std::size_t first, std::size_t count, int* valid) {
  const int used = int(std::min<std::size_t>(kLanes, count - first));
  for (int lane = 0; lane < kLanes; ++lane) valid[lane] = lane < used ? -1 : 0;
  return used;
}

// Takes out the lanes whose rays cannot be traced. The sum of a ray's coordinates decides, so that one comparison also
// finds what is not finite.
void switch_off_untraceable(const RTCRay16& rays, float limit, int* valid) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const float reach = std::fabs(rays.org_x[lane]) + std::fabs(rays.org_y[lane]) + std::fabs(rays.org_z[lane]) +
                        std::fabs(rays.dir_x[lane]) + std::fabs(rays.dir_y[lane]) + std::fabs(rays.dir_z[lane]);
    valid[lane] &= -int((reach <= limit) & (rays.tfar[lane] >= 0));
  }
}

// Rays that start far outside of a widened scene lose more to rounding than the widening covers. They are moved up to
// a sphere around it, in double precision; `moved` says how far. A ray that misses the sphere is switched off.
// False when none is far.
template <class Rays>
bool bring_near(Rays& rays, float radius, int* valid, double* moved) {
  int far = 0;
  const float reach = float(kWideningReach) * radius;
  for (int lane = 0; lane < kLanes; ++lane) {
    const float x = rays.org_x[lane], y = rays.org_y[lane], z = rays.org_z[lane];
    far |= int(x * x + y * y + z * z > reach * reach);
  }
  if (far == 0) [[likely]]
    return false;
  for (int lane = 0; lane < kLanes; ++lane) {
    moved[lane] = 0;
    const V3d o(double(rays.org_x[lane]), double(rays.org_y[lane]), double(rays.org_z[lane]));
    const V3d d(double(rays.dir_x[lane]), double(rays.dir_y[lane]), double(rays.dir_z[lane]));
    if (valid[lane] == 0 || !(length(o) > double(reach))) continue;
    // |o + t d| = the sphere's radius, from the point of the line that is closest to the centre.
    const double sphere = 0.5 * kWideningReach * double(radius), closest = -dot(o, d) / length_squared(d);
    const double off = length(o + d * closest);
    const double t = closest - std::sqrt(std::max(0.0, sphere * sphere - off * off) / length_squared(d));
    if (!(off < sphere && t > 0 && t < double(rays.tfar[lane]))) {
      valid[lane] = 0;
      continue;
    }
    const V3d start = o + d * t;
    rays.org_x[lane] = float(start.x);
    rays.org_y[lane] = float(start.y);
    rays.org_z[lane] = float(start.z);
    rays.tfar[lane] = float(double(rays.tfar[lane]) - t);
    moved[lane] = t;
  }
  return true;
}

}  // namespace

void Accel::intersect(const Ray* rays, const std::uint32_t* order, std::size_t count, Hit* hits,
                      RayOrder coherence) const {
  const bool frustum = coherence == RayOrder::camera && impl_->triangles_only;
  const bool widened = impl_->widening_radius > 0;
  AlphaContext context = make_context(*impl_, rays);
  alignas(64) RTCRayHit16 query;
  alignas(64) int valid[kLanes];
  for (std::size_t first = 0; first < count; first += kLanes) {
    const int used = lanes_of(first, count, valid);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t id = order[first + std::size_t(lane < used ? lane : 0)];
      fill_lane(query.ray, lane, rays[id], id);
      query.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    switch_off_untraceable(query.ray, impl_->ray_limit, valid);
    double moved[kLanes];
    const bool any_moved = widened && bring_near(query.ray, impl_->widening_radius, valid, moved);
    embree::intersect16(valid, impl_->top, &context, &query, frustum);
    for (int lane = 0; any_moved && lane < kLanes; ++lane) {
      query.ray.tfar[lane] = float(double(query.ray.tfar[lane]) + moved[lane]);
    }
    for (int lane = 0; lane < used; ++lane) {
      store_hit(*impl_, hits[order[first + std::size_t(lane)]], query.ray.tfar[lane], query.hit.u[lane],
                query.hit.v[lane], query.hit.Ng_x[lane], query.hit.Ng_y[lane], query.hit.Ng_z[lane],
                query.hit.geomID[lane], query.hit.primID[lane], query.hit.instID[0][lane]);
    }
  }
}

void Accel::occluded(const Ray* rays, std::size_t count, std::uint8_t* occluded) const {
  const bool widened = impl_->widening_radius > 0;
  AlphaContext context = make_context(*impl_, rays);
  alignas(64) RTCRay16 query;
  alignas(64) int valid[kLanes], traceable[kLanes];
  for (std::size_t first = 0; first < count; first += kLanes) {
    const int used = lanes_of(first, count, valid);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t id = first + std::size_t(lane < used ? lane : 0);
      fill_lane(query, lane, rays[id], unsigned(id));
    }
    switch_off_untraceable(query, impl_->ray_limit, valid);
    std::copy_n(valid, kLanes, traceable);
    double moved[kLanes];
    if (widened) bring_near(query, impl_->widening_radius, valid, moved);
    embree::occluded16(valid, impl_->top, &context, &query);
    for (int lane = 0; lane < used; ++lane) {
      occluded[first + std::size_t(lane)] = (traceable[lane] == 0) | (query.tfar[lane] < 0);
    }
  }
}

}  // namespace helio
