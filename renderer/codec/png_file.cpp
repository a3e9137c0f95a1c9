#include "renderer/codec/png_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <vector>

#include "renderer/codec/atomic_file.h"

namespace helio {
namespace {

constexpr int kLargestSide = 65535;

}  // namespace

Status write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb,
                 const std::string& description) {
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide) {
    return Error{ErrorCode::invalid_argument,
                 std::to_string(width) + " x " + std::to_string(height) + " pixels, sides in [1, 65535] allowed", path};
  }
  if (rgb.size() != std::size_t(width) * std::size_t(height) * 3) {
    return Error{ErrorCode::invalid_argument, "the pixels do not fill the picture", path};
  }
  OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("Software", "Heliograph " HELIO_VERSION);
  if (!description.empty()) spec.attribute("ImageDescription", description);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto out = OIIO::ImageOutput::create("png");
  if (!out) return Error{ErrorCode::internal, "cannot be encoded: " + OIIO::geterror(), path};
  if (!out->set_ioproxy(&memory) || !out->open(path, spec) || !out->write_image(OIIO::TypeDesc::UINT8, rgb.data()) ||
      !out->close()) {
    return Error{ErrorCode::internal, "cannot be encoded: " + out->geterror(), path};
  }
  return write_file_atomically(path, bytes);
}

}  // namespace helio
