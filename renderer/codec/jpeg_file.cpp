#include "renderer/codec/jpeg_file.h"

#include <turbojpeg.h>

#include <memory>
#include <string>

namespace helio {
namespace {

constexpr int kLargestSide = 65500;  // JPEG_MAX_DIMENSION

struct Destroy {
  void operator()(void* compressor) const { tjDestroy(compressor); }
};

}  // namespace

Result<std::vector<std::uint8_t>> encode_jpeg(int width, int height, std::span<const std::uint8_t> rgb, int quality) {
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide) {
    return Error{ErrorCode::invalid_argument,
                 std::to_string(width) + " x " + std::to_string(height) + " pixels, sides in [1, 65500] allowed",
                 "jpeg"};
  }
  if (quality < 1 || quality > kLargestJpegQuality) {
    return Error{ErrorCode::invalid_argument, "quality " + std::to_string(quality) + "; allowed: [1, 100]", "jpeg"};
  }
  if (rgb.size() != std::size_t(width) * std::size_t(height) * 3) {
    return Error{ErrorCode::invalid_argument, "the pixels do not fill the picture", "jpeg"};
  }
  const std::unique_ptr<void, Destroy> compressor(tjInitCompress());
  if (!compressor) return Error{ErrorCode::resource_exhausted, "no memory for a JPEG compressor", "jpeg"};
  std::vector<std::uint8_t> room(tjBufSize(width, height, TJSAMP_420));
  unsigned char* out = room.data();
  unsigned long size = room.size();
  if (tjCompress2(compressor.get(), rgb.data(), width, 0, height, TJPF_RGB, &out, &size, TJSAMP_420, quality,
                  TJFLAG_NOREALLOC) != 0) {
    return Error{ErrorCode::internal, std::string("cannot be encoded: ") + tjGetErrorStr2(compressor.get()), "jpeg"};
  }
  return std::vector<std::uint8_t>(room.begin(), room.begin() + std::ptrdiff_t(size));  // of no more bytes than it has
}

}  // namespace helio
