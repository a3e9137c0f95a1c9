// Copies memory past the caches: for what is not read again soon. The target's lines are not read before they are
// written, which a plain copy does, so a third of the memory traffic is saved.
#pragma once

#include <emmintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace helio {

// Of memory that does not overlap. To be followed by end_stream_copies() before another thread reads it.
inline void stream_copy(std::uint8_t* to, const std::uint8_t* from, std::size_t bytes) {
  constexpr std::size_t kStep = sizeof(__m128i);
  const std::size_t head = std::min(bytes, (kStep - reinterpret_cast<std::uintptr_t>(to) % kStep) % kStep);
  std::memcpy(to, from, head);
  const std::size_t whole = (bytes - head) / kStep * kStep;
  for (std::size_t i = head; i < head + whole; i += kStep)
    _mm_stream_si128(reinterpret_cast<__m128i*>(to + i), _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + i)));
  std::memcpy(to + head + whole, from + head + whole, bytes - head - whole);
}

inline void end_stream_copies() {
  _mm_sfence();
}

}  // namespace helio
