// A compute shader, ready to be dispatched. It reads everything by device addresses in its push constants, so there are
// no descriptors.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "renderer/vulkan/device/commands.h"
#include "renderer/vulkan/device/pipeline_objects.h"

namespace helio::vulkan {

struct Groups {
  std::uint32_t x = 1, y = 1, z = 1;
};

// Thread safe once it is created.
class ComputePipeline {
 public:
  // `spirv`: a compute shader with entry point main, as helio_add_shaders() compiles it. `push_bytes`: of its push
  // constants, a multiple of 4. `constants`: the values of its specialisation constants 0, 1, ...
  static Result<ComputePipeline> create(std::shared_ptr<Device> device, std::span<const std::uint32_t> spirv,
                                        std::uint32_t push_bytes, std::span<const std::uint32_t> constants = {});
  // Binds the pipeline and dispatches it. `push` has the size that the pipeline was created with.
  void dispatch(VkCommandBuffer commands, std::span<const std::byte> push, Groups groups) const;

 private:
  ComputePipeline() = default;

  std::shared_ptr<const PipelineObjects> objects_;
};

// Runs a shader once and waits for it: for tests.
Status run_compute(const std::shared_ptr<Device>& device, std::span<const std::uint32_t> spirv,
                   std::span<const std::byte> push, Groups groups, std::chrono::milliseconds limit = kSubmissionLimit,
                   std::span<const std::uint32_t> constants = {});

}  // namespace helio::vulkan
