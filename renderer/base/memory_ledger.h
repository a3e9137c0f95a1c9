// Counts memory that several users share, before it is allocated.
#pragma once

#include <cstdint>

#include "renderer/base/result.h"

namespace helio {

// What one user holds of it. Thread safe: a BVH is built by many threads.
class MemoryLedger {
 public:
  virtual ~MemoryLedger() = default;

  // False: so much is not left, and nothing is counted.
  virtual bool grow(std::uint64_t bytes) noexcept = 0;
  virtual void shrink(std::uint64_t bytes) noexcept = 0;
  virtual std::uint64_t held() const = 0;
  // After grow() gave false: names the limit, what was asked and what is left. `what` completes "... for WHAT".
  virtual Error refusal(std::uint64_t bytes, const std::string& what) const = 0;

  // Holds at least so much from now on.
  bool raise_to(std::uint64_t bytes) noexcept { return bytes <= held() || grow(bytes - held()); }
};

}  // namespace helio
