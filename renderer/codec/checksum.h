// The checksum of a tile's bytes on the wire.
#pragma once

#include <cstddef>
#include <cstdint>

namespace helio {

// CRC-32 of ISO 3309, as zlib and PNG have it.
std::uint32_t crc32_of(const void* bytes, std::size_t size);

}  // namespace helio
