#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/compute_pipeline.h"
#include "renderer/vulkan/device/self_test/self_test.h"

#include <helio_shaders/self_test_comp.h>

namespace helio::vulkan {

namespace {

constexpr std::uint32_t kCount = 64;

struct Answer {
  std::uint64_t integer;
  double real;
  float single;
  std::uint32_t index;
};
static_assert(sizeof(Answer) == 24);

struct Table {
  std::uint64_t numbers, answers;
  float weights[3];
  std::uint32_t count;
};
static_assert(sizeof(Table) == 32);

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

Error wrong(std::uint32_t i, const std::string& what, const std::string& found, const std::string& expected) {
  return {ErrorCode::internal,
          "invocation " + std::to_string(i) + " computed " + what + " " + found + "; expected: " + expected,
          {}};
}

}  // namespace

Status test_compute(const std::shared_ptr<Device>& device) {
  Arena arena(device);
  std::array<std::uint64_t, kCount> numbers;
  for (std::uint32_t i = 0; i < kCount; ++i) numbers[i] = (i + 1) * 0x9e3779b97f4a7c15u;
  const auto at = arena.upload_vector(std::span<const std::uint64_t>(numbers), "numbers of the self-test");
  if (!at) return at.error();
  const auto answers = Buffer::create(device, kCount * sizeof(Answer), Memory::host, "answers of the self-test");
  if (!answers) return answers.error();
  std::memset(answers->mapped().data(), 0, answers->bytes());
  const Table values{*at, answers->address(), {0.5f, 0.25f, 2}, kCount};
  const auto table = arena.upload_value(values, "the table of the self-test");
  if (!table) return table.error();
  const std::uint64_t push = *table;
  if (Status run = run_compute(device, self_test_comp, std::as_bytes(std::span(&push, 1)), {kCount / 32}); !run)
    return run;

  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Answer& answer = answers->mapped_as<Answer>()[i];
    if (answer.index != i) return wrong(i, "the index", std::to_string(answer.index), std::to_string(i));
    if (const std::uint64_t integer = mixed(numbers[i]); answer.integer != integer)
      return wrong(i, "the 64-bit integer", std::to_string(answer.integer), std::to_string(integer));
    // Vulkan leaves division and square roots of doubles a few units in the last place.
    const double real = double(numbers[i] & 0xffffff) / 3.0 + std::sqrt(double(i) + 2.0);
    if (!(std::abs(answer.real - real) <= 1e-14 * real))
      return wrong(i, "the 64-bit float", std::to_string(answer.real), std::to_string(real));
    const float single = 0.5f + 0.25f * float(i) + 2 * float(i) * float(i);
    if (!(std::abs(answer.single - single) <= 1e-5f * single))
      return wrong(i, "the 32-bit float", std::to_string(answer.single), std::to_string(single));
  }
  return ok_status();
}

}  // namespace helio::vulkan
