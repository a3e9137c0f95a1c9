// The device's acceleration structures of a scene: bottom levels for the flat parts and for each instanced object, with
// triangles and spheres apart, and a top level over them.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/scene/geometry_tables.h"

namespace helio::vulkan {

// Hit groups of ray_shaders() (rt_pipeline.h), by what an instance holds.
inline constexpr std::uint32_t kTriangleHitGroup = 0, kSphereHitGroup = 1;

class AccelerationStructures {
 public:
  // Builds the structures of what upload_meshes() has uploaded and waits for the device; sets their addresses
  // in `geometry.tables`. Precondition: the device is opened for Level::rt. Errors: resource_exhausted (more
  // primitives, instances or bytes than the device allows), cancelled, unavailable (the device was lost).
  static Result<AccelerationStructures> build(SceneGeometry& geometry, Arena& arena,
                                              const CancelToken* cancel = nullptr);
  AccelerationStructures() = default;  // none
  AccelerationStructures(AccelerationStructures&& other) noexcept;
  AccelerationStructures& operator=(AccelerationStructures&& other) noexcept;
  ~AccelerationStructures();

  std::uint64_t bytes() const;  // of device memory besides what is in the arena

 private:
  friend class StructureBuild;
  void destroy();

  std::shared_ptr<Device> device_;
  std::vector<VkAccelerationStructureKHR> structures_;
  std::vector<Buffer> buffers_;  // that hold them
};

}  // namespace helio::vulkan
