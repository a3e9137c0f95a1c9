// Runs a kernel over an array of queries about a scene, and returns its array of answers: kernels whose push constants
// are the addresses of SceneTables, queries and answers, and the number of queries, 64 of them a workgroup.
// `constants`: as of ComputePipeline::create().
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/compute_pipeline.h"

namespace helio::test {

template <class Answer, class Query>
Result<std::vector<Answer>> run_scene_queries(const std::shared_ptr<vulkan::Device>& device,
                                              std::span<const std::uint32_t> spirv, std::uint64_t scene,
                                              const std::vector<Query>& queries,
                                              std::span<const std::uint32_t> constants = {}) {
  Result<vulkan::Buffer> asked =
      vulkan::Buffer::create(device, queries.size() * sizeof(Query), vulkan::Memory::host, "queries");
  if (!asked) return std::move(asked).error();
  Result<vulkan::Buffer> answered =
      vulkan::Buffer::create(device, queries.size() * sizeof(Answer), vulkan::Memory::host, "answers");
  if (!answered) return std::move(answered).error();
  std::copy(queries.begin(), queries.end(), asked->template mapped_as<Query>().begin());
  const struct {
    std::uint64_t scene, queries, answers;
    std::uint32_t count, padding;
  } push{scene, asked->address(), answered->address(), std::uint32_t(queries.size()), 0};
  const Status done = vulkan::run_compute(device, spirv, std::as_bytes(std::span(&push, 1)),
                                          {std::uint32_t((queries.size() + 63) / 64), 1, 1}, std::chrono::seconds(120),
                                          constants);
  if (!done) return done.error();
  const std::span<Answer> answers = answered->template mapped_as<Answer>();
  return std::vector<Answer>(answers.begin(), answers.end());
}

}  // namespace helio::test
