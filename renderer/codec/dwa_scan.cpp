#include "renderer/codec/dwa_scan.h"

namespace helio {
namespace {

// OpenEXR's ImfDwaCompressor.cpp: a version, nine sizes (of the parts, compressed and not), the kind of AC coding.
constexpr std::size_t kFirstSize = 1, kLastSize = 9, kHeaderWords = 11;
constexpr std::size_t kChunkStart = 8;  // row and byte count, before the data
constexpr std::uint64_t kSlack = 4096;  // of entropy coders on a few bytes

std::uint64_t read_u64(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t(bytes[at + i]) << (8 * i);
  return value;
}

Error refuse(const char* message) {
  return {ErrorCode::invalid_argument, message, "exr"};
}

}  // namespace

Status scan_dwa_chunks(std::span<const std::uint8_t> bytes, std::size_t offsets_at, std::size_t chunks,
                       std::uint64_t chunk_bytes) {
  if (offsets_at > bytes.size() || chunks > (bytes.size() - offsets_at) / 8) return refuse("truncated chunk table");
  const std::uint64_t allowed = 2 * chunk_bytes + kSlack;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const std::uint64_t offset = read_u64(bytes, offsets_at + 8 * chunk);
    if (offset < offsets_at || offset > bytes.size() || bytes.size() - offset < kChunkStart) {
      return refuse("a chunk lies outside the file");
    }
    const std::uint64_t data = offset + kChunkStart;
    const std::uint64_t size = read_u64(bytes, offset) >> 32;
    if (size > bytes.size() - data) return refuse("a chunk is longer than the file");
    if (size >= chunk_bytes) continue;  // kept uncompressed, as the library does when DWA would not make it smaller
    if (size < 8 * kHeaderWords) return refuse("a DWA chunk is shorter than its header");
    for (std::size_t word = kFirstSize; word <= kLastSize; ++word) {
      if (read_u64(bytes, data + 8 * word) > allowed) return refuse("a DWA chunk claims more than its pixels can need");
    }
  }
  return ok_status();
}

}  // namespace helio
