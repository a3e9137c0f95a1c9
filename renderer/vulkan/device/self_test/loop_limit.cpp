#include "renderer/vulkan/device/self_test/loop_limit.h"

#include <span>
#include <utility>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/compute_pipeline.h"

#include <helio_shaders/loop_limit_comp.h>

namespace helio::vulkan {

Result<std::uint32_t> find_loop_limit(const std::shared_ptr<Device>& device) {
  constexpr std::uint32_t kRounds = 1 << 18;
  const auto answer = Buffer::create(device, 2 * sizeof(std::uint32_t), Memory::host, "a count of rounds");
  if (!answer) return answer.error();
  struct Push {
    std::uint64_t answer;
    std::uint32_t rounds, unused;
  };
  const Push push{answer->address(), kRounds, 0};
  if (Status run = run_compute(device, loop_limit_comp, std::as_bytes(std::span(&push, 1)), Groups()); !run)
    return std::move(run).error();
  const std::uint32_t counted = answer->mapped_as<std::uint32_t>().front();
  return counted == kRounds ? 0 : counted;
}

}  // namespace helio::vulkan
