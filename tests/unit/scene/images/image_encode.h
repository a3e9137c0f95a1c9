// Encodes small images in memory, so that decoding is tested against pixels that the test chose.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace helio::test {

// Bytes of an image file in OpenImageIO's format `format` ("png", "openexr", ...). `pixels` has the type that the spec
// names, channels interleaved.
inline std::vector<std::uint8_t> encode_image(const std::string& format, const OIIO::ImageSpec& spec,
                                              const void* pixels) {
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(format);
  if (!out || !out->supports("ioproxy")) {
    ADD_FAILURE() << "cannot write " << format << " to memory";
    return {};
  }
  out->set_ioproxy(&memory);
  EXPECT_TRUE(out->open("image", spec)) << out->geterror();
  EXPECT_TRUE(out->write_image(spec.format, pixels)) << out->geterror();
  EXPECT_TRUE(out->close());
  return bytes;
}

}  // namespace helio::test
