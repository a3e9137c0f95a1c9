// Asks for memory before it is read, so that it comes while other work is done. Any address may be asked for.
#pragma once

#include <cstddef>

namespace helio {

inline constexpr std::size_t kCacheLineBytes = 64;

inline void prefetch(const void* address) {
  __builtin_prefetch(address);
}

inline void prefetch_lines(const void* address, std::size_t bytes) {
  const char* first = static_cast<const char*>(address);
  for (std::size_t at = 0; at < bytes; at += kCacheLineBytes) __builtin_prefetch(first + at);
}

}  // namespace helio
