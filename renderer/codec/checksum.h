// The checksum of a tile's bytes on the wire and of files that the daemon keeps.
#pragma once

#include <cstddef>
#include <cstdint>

namespace helio {

// CRC-32 of ISO 3309, as zlib and PNG have it. `before`: of the bytes that come before these.
std::uint32_t crc32_of(const void* bytes, std::size_t size, std::uint32_t before = 0);

}  // namespace helio
