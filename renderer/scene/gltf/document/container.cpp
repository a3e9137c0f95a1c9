#include "renderer/scene/gltf/document/container.h"

#include <cstring>

namespace helio::gltf {

namespace {

constexpr std::uint32_t kMagic = 0x46546c67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004e4942;   // "BIN\0"
constexpr std::size_t kHeaderSize = 12, kChunkHeaderSize = 8;

std::uint32_t read_u32(std::span<const std::uint8_t> file, std::size_t offset) {
  return std::uint32_t(file[offset]) | std::uint32_t(file[offset + 1]) << 8 | std::uint32_t(file[offset + 2]) << 16 |
         std::uint32_t(file[offset + 3]) << 24;
}

}  // namespace

bool looks_like_glb(std::span<const std::uint8_t> file) {
  return file.size() >= 4 && read_u32(file, 0) == kMagic;
}

Result<Container> open_container(std::span<const std::uint8_t> file, const std::string& name, bool expect_glb) {
  const auto error = [&](std::size_t offset, std::string message) {
    return Error{ErrorCode::invalid_argument, std::move(message), name + "@" + std::to_string(offset)};
  };
  Container result;
  if (!looks_like_glb(file) && !expect_glb) {
    result.json = file;
    return result;
  }

  result.is_glb = true;
  if (file.size() < kHeaderSize)
    return error(file.size(),
                 "the file ends within the 12-byte GLB header, after " + std::to_string(file.size()) + " bytes");
  if (!looks_like_glb(file)) return error(0, "not a GLB: the magic \"glTF\" is missing");
  if (const std::uint32_t version = read_u32(file, 4); version != 2)
    return error(4, "GLB version is " + std::to_string(version) + ", allowed: 2");
  const std::size_t length = read_u32(file, 8);
  if (length < kHeaderSize || length > file.size())
    return error(8,
                 "the header says " + std::to_string(length) + " bytes, the file has " + std::to_string(file.size()));
  if (length < file.size())
    result.warnings.push_back(std::to_string(file.size() - length) + " bytes after the end of the GLB are ignored");

  bool json_seen = false;
  for (std::size_t offset = kHeaderSize; offset < length;) {
    if (length - offset < kChunkHeaderSize) return error(offset, "the file ends within a chunk header");
    const std::size_t size = read_u32(file, offset);
    const std::uint32_t type = read_u32(file, offset + 4);
    const std::size_t data = offset + kChunkHeaderSize;
    if (!json_seen && type != kJsonChunk) return error(offset, "the first chunk is not of type JSON");
    const bool last = size == length - data;
    if (size % 4 != 0) {
      const std::string problem = "the chunk's length " + std::to_string(size) + " is not a multiple of 4";
      if (!last) return error(offset, problem);  // nothing says whether the next one begins right behind it
      result.slips.emplace_back(offset, problem);
    }
    if (size > length - data)
      return error(offset, "the chunk says " + std::to_string(size) + " bytes, the file has " +
                               std::to_string(length - data) + " left");
    if (type == kJsonChunk) {
      if (json_seen) return error(offset, "a second JSON chunk");
      json_seen = true;
      result.json = file.subspan(data, size);
      result.json_offset = data;
    } else if (type == kBinChunk) {
      if (result.bin) return error(offset, "a second BIN chunk");
      result.bin = file.subspan(data, size);
    } else {
      result.warnings.push_back("GLB chunk of unknown type " + std::to_string(type) + " is ignored");
    }
    offset = data + size;
  }
  if (!json_seen) return error(kHeaderSize, "the JSON chunk is missing");
  return result;
}

}  // namespace helio::gltf
