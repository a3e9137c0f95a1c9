// Rays traced on a Vulkan device, without anything else of path tracing.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/trace/accel/accel.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/device/compute_pipeline.h"
#include "renderer/vulkan/device/device.h"
#include "renderer/vulkan/device/ray_pipeline.h"
#include "renderer/vulkan/scene/acceleration_structures.h"
#include "renderer/vulkan/scene/bvh.h"
#include "renderer/vulkan/scene/geometry_tables.h"

namespace helio::test {

struct RayAnswers {
  std::vector<Hit> hits;
  std::vector<std::uint8_t> occluded;
  double seconds = 0;  // of the closest hits alone, where they were asked for alone
};

// A scene on a device. Errors fail the test.
class DeviceRays {
 public:
  // `level`: whose tracer; at most that of the device.
  DeviceRays(std::shared_ptr<vulkan::Device> device, const SceneData& scene, vulkan::Level level);

  RayAnswers trace(const std::vector<Ray>& rays, bool closest = true, bool any = true) const;

  const vulkan::SceneBvh& bvh() const { return bvh_; }
  double build_seconds() const { return build_seconds_; }  // of BVH or acceleration structures
  double upload_seconds() const { return upload_seconds_; }

 private:
  void upload(const SceneData& scene);

  std::shared_ptr<vulkan::Device> device_;
  vulkan::Level level_;
  vulkan::SceneGeometry geometry_;
  vulkan::SceneBvh bvh_;
  std::unique_ptr<vulkan::Arena> arena_;
  std::unique_ptr<vulkan::AccelerationStructures> structures_;
  std::unique_ptr<vulkan::ComputePipeline> compute_;
  std::unique_ptr<vulkan::RayPipeline> pipeline_;
  std::uint64_t scene_address_ = 0;
  double build_seconds_ = 0, upload_seconds_ = 0;
};

// The same rays on the CPU.
RayAnswers trace_on_cpu(const SceneData& scene, const std::vector<Ray>& rays);

}  // namespace helio::test
