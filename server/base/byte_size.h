// Sizes as people write them.
#pragma once

#include <cstdint>
#include <string>

namespace helio {

// A count of bytes in [low, 2^50], or one with the suffix K, M, G or T (powers of 1024). Returns a clause with the
// allowed range when the text is none, else "".
std::string read_bytes(const std::string& text, std::uint64_t low, std::uint64_t& value);

}  // namespace helio
