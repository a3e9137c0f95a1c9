#include "renderer/vulkan/rt_pipeline.h"

#include <helio_shaders/nothing_rmiss.h>
#include <helio_shaders/sphere_rahit.h>
#include <helio_shaders/sphere_rchit.h>
#include <helio_shaders/sphere_rint.h>
#include <helio_shaders/triangle_rahit.h>
#include <helio_shaders/triangle_rchit.h>

#include <utility>

#include "renderer/vulkan/scene/acceleration_structures.h"

namespace helio::vulkan {

Result<RayPipeline> make_ray_pipeline(std::shared_ptr<Device> device, Spirv raygen, std::uint32_t push_bytes,
                                      std::span<const std::uint32_t> constants) {
  static_assert(kTriangleHitGroup == 0 && kSphereHitGroup == 1);
  RayShaders shaders;
  shaders.raygen = raygen;
  shaders.miss = {nothing_rmiss};
  shaders.hit_groups = {{triangle_rchit, triangle_rahit, {}}, {sphere_rchit, sphere_rahit, sphere_rint}};
  return RayPipeline::create(std::move(device), shaders, push_bytes, constants, 1);
}

}  // namespace helio::vulkan
