#include "tests/unit/vulkan/kernels.h"

#include <helio_shaders/loop_limit_comp.h>
#include <helio_shaders/sum_numbers_comp.h>

namespace helio::test {

namespace {

constexpr std::uint32_t kMostRounds = 65535;

Result<std::uint64_t> run(const std::shared_ptr<vulkan::Device>& device, std::uint64_t numbers, std::uint32_t count,
                          std::uint32_t rounds, vulkan::Groups groups, std::chrono::milliseconds limit) {
  // Of a lost device the answer may still be written when this returns; it is not freed then.
  const auto answer = vulkan::Buffer::create(device, sizeof(std::uint64_t), vulkan::Memory::host, "a sum");
  if (!answer) return answer.error();
  struct Push {
    std::uint64_t numbers, answer;
    std::uint32_t count, rounds;
  };
  const Push push{numbers, answer->address(), count, rounds};
  const Status run = vulkan::run_compute(device, sum_numbers_comp, std::as_bytes(std::span(&push, 1)), groups, limit);
  if (!run) return run.error();
  return answer->mapped_as<std::uint64_t>().front();
}

}  // namespace

Result<std::uint32_t> find_loop_limit(const std::shared_ptr<vulkan::Device>& device) {
  constexpr std::uint32_t kRounds = 1 << 18;
  const auto answer = vulkan::Buffer::create(device, 2 * sizeof(std::uint32_t), vulkan::Memory::host, "a count");
  if (!answer) return answer.error();
  struct Push {
    std::uint64_t answer;
    std::uint32_t rounds, unused;
  };
  const Push push{answer->address(), kRounds, 0};
  const Status run =
      vulkan::run_compute(device, loop_limit_comp, std::as_bytes(std::span(&push, 1)), vulkan::Groups());
  if (!run) return run.error();
  const std::uint32_t counted = answer->mapped_as<std::uint32_t>().front();
  return counted == kRounds ? 0 : counted;
}

Result<std::uint64_t> sum_on_device(const std::shared_ptr<vulkan::Device>& device, std::uint64_t numbers,
                                    std::uint32_t count) {
  HELIO_CHECK(count <= kMostRounds);
  return run(device, numbers, count, 0, vulkan::Groups(), vulkan::kSubmissionLimit);
}

Status spin_on_device(const std::shared_ptr<vulkan::Device>& device, std::chrono::milliseconds limit) {
  const auto spun = run(device, 0, 0, kMostRounds / 4, {kMostRounds, 1, 1}, limit);
  return spun ? ok_status() : Status(spun.error());
}

}  // namespace helio::test
