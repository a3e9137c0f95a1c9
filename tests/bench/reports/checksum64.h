// FNV-1a, 64 bits: the names of cached files. Not cryptographic.
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "renderer/base/hash.h"

namespace helio::bench {

class Checksum64 {
 public:
  void add_byte(std::uint8_t byte) { sum_ = fnv1a(sum_, byte); }
  void add_text(std::string_view text) {
    for (const char letter : text) add_byte(std::uint8_t(letter));
  }
  void add_number(std::uint64_t value) {
    for (int shift = 0; shift < 64; shift += 8) add_byte(std::uint8_t(value >> shift));
  }
  void add_number(double value) { add_number(std::bit_cast<std::uint64_t>(value)); }

  std::uint64_t value() const { return sum_; }

 private:
  std::uint64_t sum_ = kFnv1aStart;
};

}  // namespace helio::bench
