// Allocations that throw: a test binary that uses this has operator new replaced.
#pragma once

#include <cstdint>

namespace helio::test {

// While it lives, of the allocations that threads make, but for exempt ones, the one of number `first` (from 1) throws
// std::bad_alloc (or is null, of those that may not throw), and then each `every`-th after it; 0: that one alone. One
// at a time.
//
// Those that Embree makes are counted but do not fail: where its FastAllocator::join() or threadLocal2()
// (kernels/common/alloc.h) cannot grow a list, a thread keeps a pointer to an allocator that is freed, and the next
// build writes to it.
class FailingAllocations {
 public:
  explicit FailingAllocations(std::uint64_t first, std::uint64_t every = 0);
  ~FailingAllocations();
  FailingAllocations(const FailingAllocations&) = delete;
  FailingAllocations& operator=(const FailingAllocations&) = delete;

  std::uint64_t seen() const;
  std::uint64_t thrown() const;
};

// The calling thread's allocations are neither counted nor fail while it lives.
class ExemptFromFailing {
 public:
  ExemptFromFailing();
  ~ExemptFromFailing();
  ExemptFromFailing(const ExemptFromFailing&) = delete;
  ExemptFromFailing& operator=(const ExemptFromFailing&) = delete;
};

}  // namespace helio::test
