// The acceleration structure: batches of rays in, hits out. Embree itself appears only in accel*.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"
#include "renderer/trace/accel/edge_dilation.h"

namespace helio {

struct Ray {
  V3f origin;
  float t_max = 0;              // > 0; occlusion rays end before the light's surface
  V3f direction;                // unit
  std::uint32_t alpha_key = 0;  // decides stochastically, per hit, whether a blended surface lets this ray through
};

inline constexpr std::uint32_t kNoHit = ~0u;

struct Hit {
  float t = 0, u = 0, v = 0;    // barycentrics of the second and third corner
  V3f normal;                   // geometric, not normalised; in the object's space when instance != kNoHit
  std::uint32_t part = kNoHit;  // top level: SceneData::flat index; inside an instance: part of the object
  std::uint32_t primitive = kNoHit;
  std::uint32_t instance = kNoHit;  // SceneData::instanced index, or kNoHit for geometry of the top level

  bool valid() const { return part != kNoHit; }
};

// What is known of a hit before it is one. `part` and `instance` as in Hit.
struct AlphaHit {
  std::uint32_t part, instance, primitive;
  float u, v;
  V3f normal;  // as in Hit
  bool front;  // the ray arrives against the normal
  std::uint32_t alpha_key;
};

// Decides whether a hit on a surface with alpha exists for a ray.
class AlphaTest {
 public:
  virtual ~AlphaTest() = default;
  virtual bool opaque_at(const AlphaHit& hit) const = 0;
};

// Geometry handed to the builder. Arrays must outlive the Accel (they are shared, not copied) and be padded: the last
// position must be followed by at least 4 readable bytes.
struct AccelPart {
  enum class Kind : std::uint8_t { triangles, sphere };
  Kind kind = Kind::triangles;
  const V3f* positions = nullptr;
  std::size_t vertex_count = 0;
  const std::uint32_t* indices = nullptr;
  std::size_t triangle_count = 0;
  V4f sphere{0, 0, 0, 1};  // centre, radius
  bool alpha = false;      // hits are subject to the AlphaTest
};

struct AccelObject {
  std::vector<AccelPart> parts;
};

struct AccelInstance {
  std::uint32_t object = 0;
  float to_world[12];  // column-major 3x4: columns x, y, z axis, translation
};

struct AccelInput {
  std::vector<AccelPart> flat;       // world space
  std::vector<AccelObject> objects;  // bottom level
  std::vector<AccelInstance> instances;
  const AlphaTest* alpha_test = nullptr;  // required when any part has alpha
  // Radius of a sphere around the origin that holds everything: trace without Embree's robust mode, triangles widened
  // so that neighbours overlap. 0: robust mode. Precondition of a radius: no instances.
  float edge_dilation_radius = 0;
  float edge_dilation = float(kEdgeDilation);  // in radii; other values are for measuring what it is good for
  int threads = 0;
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();  // of the BVH and of what its build takes meanwhile
  MemoryLedger* ledger = nullptr;       // what Embree allocates is taken from it besides, and left in it; null: none
  const CancelToken* cancel = nullptr;  // looked at before and during the build; null: never
};

// What an edited scene asks of the Accel of the scene that it was made from. Flat parts keep their numbers.
struct AccelEdit {
  std::vector<bool> taken_out;           // by flat part: not there any more; none that was so before comes back
  std::vector<AccelObject> new_objects;  // bottom levels that the base has not; numbered after its own
  std::vector<AccelInstance> instances;  // all that there are
  // Flat parts that were widened when they were built are replaced by robust ones: the scene has outgrown its
  // edge_dilation.
  bool robust = false;
  int threads = 0;
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();
  MemoryLedger* ledger = nullptr;
  const CancelToken* cancel = nullptr;
};

// Bytes of what Accels may share, and a key that is the same for all that do.
struct AccelShare {
  std::shared_ptr<const void> what;
  std::size_t bytes = 0;
};

// What is known about rays that follow one another.
enum class RayOrder {
  camera,     // they share an origin or nearly so, and run side by side
  scattered,  // anything
};

class Accel {
 public:
  // Errors: resource_exhausted (max_bytes, the ledger, or the machine's memory), cancelled.
  static Result<std::unique_ptr<Accel>> build(const AccelInput& input);
  // The BVH of `base`, all of it, for a scene that differs in materials and lights only.
  static std::unique_ptr<Accel> share(const Accel& base, const AlphaTest* alpha_test);
  // A new top level over what is shared with `base`: its bottom levels, and one more bottom level of all flat parts
  // that are left, which is built where the base has none of just these parts. Where no flat part is taken out that was
  // not before, only the top level and new_objects are built: as many nodes as there are instances. Rays find in it
  // what they find in the base, numbers of hits included. Errors: as build().
  static Result<std::unique_ptr<Accel>> edit(const Accel& base, const AccelEdit& edit, const AlphaTest* alpha_test);
  ~Accel();

  // Rays of one call are traced together, sixteen at a time. They influence each other in the last
  // bit (which of two triangles a shared edge belongs to), so a caller that needs the same bits again must hand over
  // the same rays in the same order.
  //
  // A ray that float cannot carry (a number that is not finite, coordinates beyond 1e18, also in the space of a tiny
  // instance) hits nothing and is occluded.

  // Closest hits of rays[order[i]], i < count, into hits[order[i]].
  void intersect(const Ray* rays, const std::uint32_t* order, std::size_t count, Hit* hits, RayOrder coherence) const;
  // occluded[i] = 1 when something lies on rays[i] before t_max, i < count.
  void occluded(const Ray* rays, std::size_t count, std::uint8_t* occluded) const;

  Box3f bounds() const;
  std::size_t memory_bytes() const;          // what is shared with other Accels included
  std::vector<AccelShare> shares() const;    // they add up to memory_bytes()
  std::size_t object_count() const;          // bottom levels, that of the flat parts aside
  float edge_dilation_radius() const;        // as in AccelInput
  float ray_limit() const;                   // rays whose coordinates add up to more hit nothing and are occluded
  float built_edge_dilation_radius() const;  // that of the scene as loaded, whatever an edit has made of it
  static const char* version();              // "Embree 4.3.3"

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  explicit Accel(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
