#include "tests/support/failing_allocations.h"

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>

namespace helio::test {
namespace {

std::atomic<bool> g_active{false};
std::atomic<std::uint64_t> g_first{0}, g_every{0}, g_seen{0}, g_thrown{0};
thread_local int t_exempt = 0;

bool is_in_embree(const void* code) {
  Dl_info info;
  return dladdr(code, &info) != 0 && std::strstr(info.dli_fname, "libembree") != nullptr;
}

bool fails(const void* caller) {
  if (!g_active.load(std::memory_order_relaxed) || t_exempt > 0) return false;
  const std::uint64_t number = ++g_seen, first = g_first, every = g_every;
  const bool chosen = number == first || (number > first && every > 0 && (number - first) % every == 0);
  if (!chosen || is_in_embree(caller)) return false;
  ++g_thrown;
  return true;
}

// Null: it fails. While some fail, memory comes filled: who frees a pointer that was never set does not find a null
// one.
void* try_allocate(std::size_t bytes, std::size_t alignment, const void* caller) {
  constexpr std::size_t kFilled = 4096;
  if (fails(caller)) return nullptr;
  // aligned_alloc() wants a multiple of the alignment.
  void* const memory = alignment == 0 ? std::malloc(bytes > 0 ? bytes : 1)
                                      : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory && g_active.load(std::memory_order_relaxed)) std::memset(memory, 0xa5, std::min(bytes, kFilled));
  return memory;
}

void* allocate(std::size_t bytes, std::size_t alignment, const void* caller) {
  void* memory = try_allocate(bytes, alignment, caller);
  if (!memory) throw std::bad_alloc();
  return memory;
}

}  // namespace

FailingAllocations::FailingAllocations(std::uint64_t first, std::uint64_t every) {
  g_first = first;
  g_every = every;
  g_seen = g_thrown = 0;
  g_active = true;
}

FailingAllocations::~FailingAllocations() {
  g_active = false;
}

std::uint64_t FailingAllocations::seen() const {
  return g_seen;
}

std::uint64_t FailingAllocations::thrown() const {
  return g_thrown;
}

ExemptFromFailing::ExemptFromFailing() {
  ++t_exempt;
}

ExemptFromFailing::~ExemptFromFailing() {
  --t_exempt;
}

}  // namespace helio::test

void* operator new(std::size_t bytes) {
  return helio::test::allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new[](std::size_t bytes) {
  return helio::test::allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return helio::test::allocate(bytes, std::size_t(alignment), __builtin_return_address(0));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return helio::test::allocate(bytes, std::size_t(alignment), __builtin_return_address(0));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return helio::test::try_allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return helio::test::try_allocate(bytes, 0, __builtin_return_address(0));
}
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return helio::test::try_allocate(bytes, std::size_t(alignment), __builtin_return_address(0));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return helio::test::try_allocate(bytes, std::size_t(alignment), __builtin_return_address(0));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
