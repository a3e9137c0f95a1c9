// What a thread has worked out lately, by the bits of the numbers that it depends on. For values that take far longer to
// make than to copy and that neighbouring paths ask for again: those of a material without textures. It changes no
// result, whatever it holds.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "renderer/base/hash.h"

namespace helio {

template <class Value, std::size_t kNumbers>
class RecentValues {
 public:
  using Key = std::array<float, kNumbers>;

  // make() is called where the value is not there, and takes the place of another one. By value: a later call may
  // overwrite what is kept.
  template <class Make>
  Value get(const Key& key, const Make& make) {
    const Bits bits = std::bit_cast<Bits>(key);
    Slot& slot = slots_[index_of(bits)];
    if (!slot.value || slot.bits != bits) {
      slot.value.emplace(make());
      slot.bits = bits;
    }
    return *slot.value;
  }

 private:
  using Bits = std::array<std::uint32_t, kNumbers>;
  static constexpr std::size_t kSlots = 16;
  struct Slot {
    Bits bits{};
    std::optional<Value> value;
  };

  // FNV-1a by words, and the upper bits of its product.
  static std::size_t index_of(const Bits& bits) {
    std::uint64_t hash = kFnv1aStart;
    for (const std::uint32_t word : bits) hash = fnv1a(hash, word);
    return std::size_t((hash * 0x9e3779b97f4a7c15u) >> 60);
  }
  static_assert(kSlots == 16);

  std::array<Slot, kSlots> slots_{};
};

}  // namespace helio
