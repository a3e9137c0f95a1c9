#include "renderer/trace/accel/accel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "renderer/trace/accel/accel_impl.h"
#include "renderer/trace/accel/build_arena.h"

namespace helio {
namespace {

using embree::AlphaContext;

constexpr int kLanes = 16;

// What one build has allocated and not freed. It leaves the ledger again unless it is kept.
class BuildMemory {
 public:
  BuildMemory(std::size_t max_bytes, MemoryLedger* ledger)
      : limit_(std::ptrdiff_t(std::min(max_bytes, std::size_t(std::numeric_limits<std::ptrdiff_t>::max())))),
        ledger_(ledger) {}
  BuildMemory(const BuildMemory&) = delete;
  ~BuildMemory() {
    if (ledger_ && !kept_) ledger_->shrink(std::uint64_t(std::max<std::ptrdiff_t>(0, bytes_)));
  }

  // False: so much is not left. `made`: it is allocated already, which cannot be refused any more.
  bool count(std::ptrdiff_t bytes, bool made) noexcept {
    if (bytes <= 0) {
      bytes_ += bytes;
      if (ledger_) ledger_->shrink(std::uint64_t(-bytes));
      return true;
    }
    std::ptrdiff_t before = bytes_;
    do {
      if (!made && bytes > limit_ - before) return false;
    } while (!bytes_.compare_exchange_weak(before, before + bytes));
    if (!ledger_ || ledger_->grow(std::uint64_t(bytes)) || made) return true;
    bytes_ -= bytes;
    refused_ = bytes;
    return false;
  }
  void keep() { kept_ = true; }
  RTCError error = RTC_ERROR_NONE;  // the first; Embree keeps one for each thread
  std::ptrdiff_t bytes() const { return bytes_; }
  // The ledger's error, once it has refused something.
  std::optional<Error> refusal() const {
    if (refused_ == 0) return std::nullopt;
    return ledger_->refusal(std::uint64_t(refused_.load()), "the BVH");
  }

 private:
  const std::ptrdiff_t limit_;
  MemoryLedger* const ledger_;
  std::atomic<std::ptrdiff_t> bytes_{0}, refused_{0};
  bool kept_ = false;
};

// Embree tells of each allocation, not for which scene it is. The threads of a build bear its number: what others free
// meanwhile is another scene's. Threads may leave an arena unseen, with a number that is over.
thread_local std::uint64_t t_build_number = 0;

// The builds that are on, each in a slot of its own while it lasts: an edit, for which someone waits at the screen,
// does not wait for the build of a load.
constexpr std::size_t kMostBuilds = 8;
constexpr std::chrono::milliseconds kCancelPoll(5);

class BuildInProgress {
 public:
  // Null when `cancel` comes while others hold all slots.
  static std::unique_ptr<BuildInProgress> begin(BuildMemory& memory, const CancelToken* cancel) {
    std::unique_lock lock(mutex());
    const auto is_free = [](const Slot& slot) { return slot.number == 0; };
    for (;;) {
      if (cancel && cancel->cancelled()) return nullptr;
      const auto slot = std::find_if(slots().begin(), slots().end(), is_free);
      if (slot != slots().end()) {
        static std::uint64_t builds = 0;
        slot->memory = &memory;
        slot->number = ++builds * kMostBuilds + std::uint64_t(slot - slots().begin());
        return std::unique_ptr<BuildInProgress>(new BuildInProgress(*slot));
      }
      slot_freed().wait_for(lock, kCancelPoll);
    }
  }
  BuildInProgress(const BuildInProgress&) = delete;
  ~BuildInProgress() {
    {
      const std::lock_guard lock(mutex());
      slot_.number = 0;
    }
    slot_freed().notify_one();
  }

  std::uint64_t number() const { return slot_.number; }
  static bool count_bytes(void*, ssize_t bytes, bool allocated) {
    const std::uint64_t number = t_build_number;
    if (number == 0) return true;
    const Slot& slot = slots()[number % kMostBuilds];
    return slot.number != number || slot.memory->count(bytes, allocated);
  }

 private:
  struct Slot {
    std::atomic<std::uint64_t> number{0};  // 0: free
    BuildMemory* memory = nullptr;
  };
  explicit BuildInProgress(Slot& slot) : slot_(slot) {}

  static std::array<Slot, kMostBuilds>& slots() {
    static std::array<Slot, kMostBuilds> all;
    return all;
  }
  static std::mutex& mutex() {
    static std::mutex of_slots;
    return of_slots;
  }
  static std::condition_variable& slot_freed() {
    static std::condition_variable freed;
    return freed;
  }

  Slot& slot_;
};

class BuildThreads final : public tbb::task_scheduler_observer {
 public:
  BuildThreads(tbb::task_arena& arena, std::uint64_t number) : task_scheduler_observer(arena), number_(number) {
    observe(true);
  }
  ~BuildThreads() override { observe(false); }
  void on_scheduler_entry(bool) override { t_build_number = number_; }
  void on_scheduler_exit(bool) override { t_build_number = 0; }

 private:
  const std::uint64_t number_;
};

bool go_on(void* cancel, double) {
  return !static_cast<const CancelToken*>(cancel)->cancelled();
}

// embree::device(), told to report what it allocates.
RTCDevice device() {
  static const RTCDevice instance = [] {
    RTCDevice created = embree::device();
    if (created) rtcSetDeviceMemoryMonitorFunction(created, BuildInProgress::count_bytes, nullptr);
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
    const bool placed = instance != RTC_INVALID_GEOMETRY_ID && instance != context->rest_id;
    hit.instance = placed ? instance - context->flat_count : kNoHit;
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
    if (!sphere) {
      rtcReleaseGeometry(geometry);
      return nullptr;
    }
    *sphere = part.sphere;
  }
  if (part.alpha) {
    rtcSetGeometryIntersectFilterFunction(geometry, alpha_filter);
    rtcSetGeometryOccludedFilterFunction(geometry, alpha_filter);
  }
  rtcCommitGeometry(geometry);
  return geometry;
}

RTCScene make_scene(bool robust, const CancelToken* cancel) {
  RTCScene scene = rtcNewScene(device());
  rtcSetSceneFlags(scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  if (cancel) rtcSetSceneProgressMonitorFunction(scene, go_on, const_cast<CancelToken*>(cancel));
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

void commit(RTCScene scene) {
  rtcCommitScene(scene);
  // The token ends with the build, the scene does not.
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
}

// Stops where memory runs out; Embree keeps the error.
void attach_parts(RTCScene scene, const std::vector<AccelPart>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    RTCGeometry geometry = make_geometry(parts[i], 0);
    if (!geometry) return;
    rtcAttachGeometryByID(scene, geometry, unsigned(i));
    rtcReleaseGeometry(geometry);
  }
}

// As above.
void make_geometries(FlatGeometry& flat, double margin) {
  flat.geometries.reserve(flat.parts.size());
  for (const AccelPart& part : flat.parts) {
    RTCGeometry geometry = make_geometry(part, margin);
    if (!geometry) return;
    flat.geometries.push_back(geometry);
  }
}

// The flat parts that are there, under their own numbers.
void attach_flat(RTCScene scene, const FlatGeometry& flat, const std::vector<bool>& taken_out) {
  for (std::size_t i = 0; i < flat.geometries.size(); ++i) {
    if (taken_out.empty() || !taken_out[i]) rtcAttachGeometryByID(scene, flat.geometries[i], unsigned(i));
  }
}

void attach_instance(RTCScene scene, RTCScene object, const float* to_world, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, object);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, to_world);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

// Instances share the id space of the top level with the flat parts; they follow them.
void attach_instances(RTCScene scene, const std::vector<AccelInstance>& instances, const std::vector<RTCScene>& objects,
                      std::uint32_t flat_count) {
  for (std::size_t i = 0; i < instances.size(); ++i) {
    attach_instance(scene, objects[instances[i].object], instances[i].to_world, unsigned(flat_count + i));
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

namespace {

double reach_limit(const std::vector<AccelInstance>& instances) {
  double limit = kMaxRayReach;
  for (const AccelInstance& instance : instances) limit = std::min(limit, ray_limit(instance));
  return limit;
}

// Calls `build`, with what it allocates, in an arena of `threads`.
template <class Input, class Build>
Status run_build(const Input& input, BuildMemory& memory, const Build& build) {
  const CancelToken* const cancel = input.cancel;
  const auto in_progress = BuildInProgress::begin(memory, cancel);
  if (!in_progress) return build_error(RTC_ERROR_CANCELLED, input.max_bytes);
  tbb::task_arena arena(build_concurrency(input.threads));
  arena.initialize();
  {
    const NiceBuildWorkers nice(arena);
    const BuildThreads observer(arena, in_progress->number());
    arena.execute([&] {
      rtcGetDeviceError(device());
      build();
      if (memory.error == RTC_ERROR_NONE) memory.error = rtcGetDeviceError(device());
    });
  }
  if (cancel && cancel->cancelled()) return build_error(RTC_ERROR_CANCELLED, input.max_bytes);
  if (auto refusal = memory.refusal()) return *std::move(refusal);
  if (memory.error != RTC_ERROR_NONE) return build_error(memory.error, input.max_bytes);
  memory.keep();
  return ok_status();
}

// Whether Embree has reported an error since the build began. Then nothing more may be built of what there is: Embree
// crashes over instances of an object whose build has failed.
bool failed(BuildMemory& memory) {
  if (memory.error == RTC_ERROR_NONE) memory.error = rtcGetDeviceError(device());
  return memory.error != RTC_ERROR_NONE;
}

// By how much a build's memory has grown while it lived.
class BytesTaken {
 public:
  explicit BytesTaken(const BuildMemory& memory) : memory_(memory), before_(memory.bytes()) {}
  std::size_t operator()() const { return std::size_t(std::max<std::ptrdiff_t>(0, memory_.bytes() - before_)); }

 private:
  const BuildMemory& memory_;
  const std::ptrdiff_t before_;
};

std::shared_ptr<const AccelScenes> build_objects(const std::vector<AccelObject>& objects, bool robust,
                                                 const CancelToken* cancel, BuildMemory& memory) {
  auto built = std::make_shared<AccelScenes>();
  const BytesTaken bytes(memory);
  built->scenes.reserve(objects.size());
  for (const AccelObject& object : objects) {
    if (cancel && cancel->cancelled()) break;
    RTCScene scene = make_scene(robust, cancel);
    built->scenes.push_back(scene);
    attach_parts(scene, object.parts);
    commit(scene);
    if (failed(memory)) break;
  }
  built->bytes = bytes();
  return built;
}

}  // namespace

FlatGeometry::~FlatGeometry() {
  for (RTCGeometry geometry : geometries) rtcReleaseGeometry(geometry);
}

AccelScenes::~AccelScenes() {
  for (RTCScene scene : scenes) rtcReleaseScene(scene);
}

std::vector<RTCScene> Accel::Impl::object_scenes() const {
  std::vector<RTCScene> scenes;
  for (const auto& built : objects) scenes.insert(scenes.end(), built->scenes.begin(), built->scenes.end());
  return scenes;
}

Accel::Accel(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Accel::~Accel() = default;

Result<std::unique_ptr<Accel>> Accel::build(const AccelInput& input) {
  if (!device()) return Error{ErrorCode::internal, "Embree cannot create a device", {}};
  BuildMemory memory(input.max_bytes, input.ledger);  // goes after what was built
  auto impl = std::make_unique<Impl>();
  impl->alpha_test = input.alpha_test;
  impl->flat_count = std::uint32_t(input.flat.size());
  impl->triangles_only = input.instances.empty();
  for (const AccelPart& part : input.flat) {
    if (part.kind != AccelPart::Kind::triangles) impl->triangles_only = false;
  }
  impl->ray_limit = float(reach_limit(input.instances));
  impl->edge_dilation_radius = input.edge_dilation_radius;
  const bool robust = !(input.edge_dilation_radius > 0);
  const Status built = run_build(input, memory, [&] {
    if (!input.objects.empty()) impl->objects.push_back(build_objects(input.objects, robust, input.cancel, memory));
    if (failed(memory) || (input.cancel && input.cancel->cancelled())) return;
    const BytesTaken flat_bytes(memory);
    auto flat = std::make_shared<FlatGeometry>();
    flat->parts = input.flat;
    flat->edge_dilation_radius = input.edge_dilation_radius;
    make_geometries(*flat, double(input.edge_dilation_radius) * double(input.edge_dilation));
    flat->bytes = flat_bytes();
    if (failed(memory)) return;
    const BytesTaken top_bytes(memory);
    auto top = std::make_shared<AccelScenes>();
    top->scenes.reserve(1);
    impl->top = top->scenes.emplace_back(make_scene(robust, input.cancel));
    attach_flat(impl->top, *flat, {});
    attach_instances(impl->top, input.instances, impl->object_scenes(), impl->flat_count);
    commit(impl->top);
    top->bytes = top_bytes();
    impl->flat = std::move(flat);
    impl->top_level = std::move(top);
  });
  if (!built) return built.error();
  return std::unique_ptr<Accel>(new Accel(std::move(impl)));
}

std::unique_ptr<Accel> Accel::share(const Accel& base, const AlphaTest* alpha_test) {
  auto impl = std::make_unique<Impl>(*base.impl_);
  impl->alpha_test = alpha_test;
  return std::unique_ptr<Accel>(new Accel(std::move(impl)));
}

Result<std::unique_ptr<Accel>> Accel::edit(const Accel& base, const AccelEdit& edit, const AlphaTest* alpha_test) {
  BuildMemory memory(edit.max_bytes, edit.ledger);  // goes after what was built
  auto impl = std::make_unique<Impl>(*base.impl_);
  impl->alpha_test = alpha_test;
  impl->top = nullptr;
  impl->top_level.reset();
  impl->taken_out = edit.taken_out;
  impl->triangles_only = false;
  impl->flat_count = 0;  // of the top level
  impl->ray_limit = float(reach_limit(edit.instances));
  const Impl& before = *base.impl_;
  const bool give_up = edit.robust && impl->edge_dilation_radius > 0, restore = !edit.robust && impl->widened;
  const bool same_rest = before.rest && before.taken_out == edit.taken_out && !give_up && !restore;
  if (give_up) impl->widened = before.flat;
  if (restore) impl->flat = std::exchange(impl->widened, nullptr);
  impl->edge_dilation_radius = edit.robust ? 0 : impl->flat->edge_dilation_radius;
  const bool any_flat = std::find(edit.taken_out.begin(), edit.taken_out.end(), false) != edit.taken_out.end();
  const Status built = run_build(edit, memory, [&] {
    if (!edit.new_objects.empty()) {
      impl->objects.push_back(build_objects(edit.new_objects, true, edit.cancel, memory));
    }
    if (failed(memory) || (edit.cancel && edit.cancel->cancelled())) return;
    if (give_up) {
      auto flat = std::make_shared<FlatGeometry>();
      flat->parts = before.flat->parts;
      make_geometries(*flat, 0);
      impl->flat = std::move(flat);
    }
    if (!same_rest) impl->rest.reset();
    if (!same_rest && any_flat) {
      const BytesTaken rest_bytes(memory);
      auto rest = std::make_shared<AccelScenes>();
      rest->scenes.reserve(1);
      rest->scenes.push_back(make_scene(!(impl->edge_dilation_radius > 0), edit.cancel));
      attach_flat(rest->scenes[0], *impl->flat, edit.taken_out);
      commit(rest->scenes[0]);
      rest->bytes = rest_bytes();
      impl->rest = std::move(rest);
    }
    if (failed(memory) || (edit.cancel && edit.cancel->cancelled())) return;
    const BytesTaken top_bytes(memory);
    auto top = std::make_shared<AccelScenes>();
    top->scenes.reserve(1);
    impl->top = top->scenes.emplace_back(make_scene(true, edit.cancel));
    attach_instances(impl->top, edit.instances, impl->object_scenes(), impl->flat_count);
    impl->rest_id = RTC_INVALID_GEOMETRY_ID;
    if (impl->rest) {
      static constexpr float kIdentity[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
      impl->rest_id = std::uint32_t(edit.instances.size());
      attach_instance(impl->top, impl->rest->scenes[0], kIdentity, impl->rest_id);
    }
    commit(impl->top);
    top->bytes = top_bytes();
    impl->top_level = std::move(top);
  });
  if (!built) return built.error();
  return std::unique_ptr<Accel>(new Accel(std::move(impl)));
}

std::vector<AccelShare> Accel::shares() const {
  std::vector<AccelShare> shares;
  shares.push_back({impl_->top_level, impl_->top_level->bytes});
  shares.push_back({impl_->flat, impl_->flat->bytes});
  if (impl_->widened) shares.push_back({impl_->widened, impl_->widened->bytes});
  if (impl_->rest) shares.push_back({impl_->rest, impl_->rest->bytes});
  for (const auto& objects : impl_->objects) shares.push_back({objects, objects->bytes});
  return shares;
}

std::size_t Accel::memory_bytes() const {
  std::size_t bytes = 0;
  for (const AccelShare& share : shares()) bytes += share.bytes;
  return bytes;
}

std::size_t Accel::object_count() const {
  std::size_t count = 0;
  for (const auto& objects : impl_->objects) count += objects->scenes.size();
  return count;
}

float Accel::edge_dilation_radius() const {
  return impl_->edge_dilation_radius;
}

float Accel::ray_limit() const {
  return impl_->ray_limit;
}

float Accel::built_edge_dilation_radius() const {
  return (impl_->widened ? impl_->widened : impl_->flat)->edge_dilation_radius;
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
  context.rest_id = impl.rest_id;
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
  out.instance = impl.instance(instance);
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

// Lanes from `used` on are off.
int lanes_of(std::size_t first, std::size_t count, int* valid) {
  const int used = int(std::min<std::size_t>(kLanes, count - first));
  for (int lane = 0; lane < kLanes; ++lane) valid[lane] = lane < used ? -1 : 0;
  return used;
}

// Lanes that are off hold this. Embree 3.13 does not look at which lanes are valid where it has to trace a packet in
// two, for want of instructions that are wide enough: a ray that ends before it begins is left alone there, too.
constexpr Ray kNoRay{V3f(0, 0, 0), -1, V3f(0, 0, 1), 0};

void switch_off(RTCRay16& rays, int lane, int* valid) {
  fill_lane(rays, lane, kNoRay, rays.id[lane]);
  valid[lane] = 0;
}

// Takes out the lanes whose rays cannot be traced. The sum of a ray's coordinates decides, so that one comparison also
// finds what is not finite.
void switch_off_untraceable(RTCRay16& rays, float limit, int* valid) {
  int any = 0, traceable[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) {
    const float reach = std::fabs(rays.org_x[lane]) + std::fabs(rays.org_y[lane]) + std::fabs(rays.org_z[lane]) +
                        std::fabs(rays.dir_x[lane]) + std::fabs(rays.dir_y[lane]) + std::fabs(rays.dir_z[lane]);
    traceable[lane] = valid[lane] & -int((reach <= limit) & (rays.tfar[lane] >= 0));
    any |= ~traceable[lane];
  }
  if (any == 0) [[likely]]
    return;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (traceable[lane] == 0) switch_off(rays, lane, valid);
  }
}

// Rays that start far outside of a widened scene lose more to rounding than edge dilation covers. They are moved up
// to a sphere around it, in double precision; `moved` says how far. A ray that misses the sphere is switched off. False
// when none is far.
template <class Rays>
bool bring_near(Rays& rays, float radius, int* valid, double* moved) {
  int far = 0;
  const float reach = float(kEdgeDilationReach) * radius;
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
    const double sphere = 0.5 * kEdgeDilationReach * double(radius), closest = -dot(o, d) / length_squared(d);
    const double off = length(o + d * closest);
    const double t = closest - std::sqrt(std::max(0.0, sphere * sphere - off * off) / length_squared(d));
    if (!(off < sphere && t > 0 && t < double(rays.tfar[lane]))) {
      switch_off(rays, lane, valid);
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
  const bool widened = impl_->edge_dilation_radius > 0;
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
    const bool any_moved = widened && bring_near(query.ray, impl_->edge_dilation_radius, valid, moved);
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
  const bool widened = impl_->edge_dilation_radius > 0;
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
    if (widened) bring_near(query, impl_->edge_dilation_radius, valid, moved);
    embree::occluded16(valid, impl_->top, &context, &query);
    for (int lane = 0; lane < used; ++lane) {
      occluded[first + std::size_t(lane)] = (traceable[lane] == 0) | ((valid[lane] != 0) & (query.tfar[lane] < 0));
    }
  }
}

}  // namespace helio
