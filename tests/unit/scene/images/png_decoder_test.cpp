#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <utility>
#include <vector>

#include "renderer/scene/images/image_decoder.h"

namespace helio {
namespace {

const std::string kSignature = "\x89PNG\r\n\x1a\n";

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
  return bytes;
}

std::string chunk(const std::string& type, const std::string& data, std::uint32_t crc_error = 0) {
  const std::string body = type + data;
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
  return big_endian(std::uint32_t(data.size())) + body + big_endian(std::uint32_t(crc) ^ crc_error);
}

std::string header(int width, int height, int depth, int color_type, int interlace = 0) {
  return chunk("IHDR",
               big_endian(width) + big_endian(height) + char(depth) + char(color_type) + '\0' + '\0' + char(interlace));
}

std::string deflated(const std::string& bytes) {
  std::string out(compressBound(bytes.size()), '\0');
  uLongf size = out.size();
  compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 9);
  out.resize(size);
  return out;
}

// 8 rows of 8 RGB pixels, each with a filter byte before it.
std::string rgb_rows(char filter = 0) {
  std::string rows;
  for (int y = 0; y < 8; ++y) rows += filter + std::string(24, char(17 * y));
  return rows;
}

const std::string kHeader = header(8, 8, 8, 2), kEnd = chunk("IEND", "");

// What the decoder says, and that nothing else was said. "": an image.
std::string decode(const std::string& png) {
  const std::vector<std::uint8_t> bytes(png.begin(), png.end());
  testing::internal::CaptureStderr();
  const Result<Image> image = decode_image(bytes, "p.png", 1 << 20);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  return image ? "" : image.error().message;
}

TEST(PngDecoder, WhatIsBrokenIsRefusedInSilence) {
  const std::string z = deflated(rgb_rows()), data = chunk("IDAT", z);
  struct Case {
    std::string png, fault;
  };
  const Case cases[] = {
      {header(8, 8, 3, 2) + data + kEnd, "invalid bit depth"},
      {header(8, 8, 16, 3) + data + kEnd, "invalid bit depth"},
      {header(8, 8, 8, 2, 2) + data + kEnd, "invalid interlace method"},
      {chunk("IHDR", kHeader.substr(8, 13) + "x") + data + kEnd, "invalid IHDR chunk size"},
      {chunk("IHDR", kHeader.substr(8, 13), 1) + data + kEnd, "invalid chunk checksum"},
      {kHeader + kHeader + data + kEnd, "invalid chunk position"},
      {kHeader + kEnd, "invalid chunk position"},
      {kHeader, "end of stream"},
      {(kHeader + data).substr(0, kHeader.size() + 20), "end of stream"},
      {kHeader + chunk("IDAT", z.substr(0, 7), 1) + chunk("IDAT", z.substr(7)) + kEnd, "invalid chunk checksum"},
      {kHeader + chunk("ABCD", "x") + data + kEnd, "unknown critical chunk"},
      {kHeader + big_endian(0x90000000u) + "IDAT" + z + kEnd, "chunk exceeds maximum standard length"},
      {header(8, 8, 8, 3) + data + kEnd, "missing PLTE for indexed image"},
      {header(8, 8, 8, 3) + chunk("PLTE", "1234") + data + kEnd, "invalid chunk length"},
      {kHeader + chunk("IDAT", deflated(rgb_rows().substr(0, 50))) + kEnd, "IDAT stream too short"},
      {kHeader + chunk("IDAT", z.substr(0, 8)) + kEnd, "IDAT stream too short"},
      {kHeader + chunk("IDAT", z.substr(0, 5)) + chunk("tEXt", "a") + chunk("IDAT", z.substr(5)) + kEnd,
       "IDAT stream too short"},
      {kHeader + chunk("IDAT", std::string("\0\0", 2) + z.substr(2)) + kEnd, "IDAT stream error"},
      {kHeader + chunk("IDAT", z.substr(0, z.size() - 4) + "1234") + kEnd, "IDAT stream error"},
      {kHeader + chunk("IDAT", deflated(rgb_rows(5))) + kEnd, "invalid scanline filter"},
  };
  for (const Case& c : cases) EXPECT_EQ(decode(kSignature + c.png), "PNG is broken or cut off: " + c.fault);
}

TEST(PngDecoder, WhatLibpngTakesIsTaken) {
  const std::string z = deflated(rgb_rows()), data = chunk("IDAT", z);
  const std::string wide = deflated(std::string(8 * 25, '\0') + rgb_rows());
  // Adam7 of 5x5 grey pixels: passes of 1x1, 1x1, 2x1, 1x2, 3x1, 2x3 and 5x2 (columns x rows), a filter byte a row.
  std::string interlaced;
  const std::pair<int, int> passes[] = {{1, 1}, {1, 1}, {2, 1}, {1, 2}, {3, 1}, {2, 3}, {5, 2}};
  for (const auto& [columns, rows] : passes) {
    for (int y = 0; y < rows; ++y) interlaced += std::string(1 + columns, '\1');
  }
  const std::string pngs[] = {
      kHeader + data + kEnd,
      kHeader + data,                         // no IEND
      kHeader + data + chunk("IEND", "", 1),  // nobody looks there
      kHeader + chunk("IDAT", z.substr(0, 7)) + chunk("IDAT", "") + chunk("IDAT", z.substr(7)) + kEnd,
      kHeader + chunk("IDAT", wide) + kEnd,                        // more rows than the image has
      kHeader + chunk("IDAT", z + std::string(1000, 'x')) + kEnd,  // bytes behind the stream
      kHeader + chunk("tEXt", "a", 1) + data + kEnd,               // not critical
      kHeader + chunk("1bCD", "x") + data + kEnd,                  // nor is this
      kHeader + chunk("IDAT", z, 1) + kEnd,                        // the zlib stream has a sum of its own
      kHeader + chunk("iCCP", std::string("a\0\0broken", 9)) + data + kEnd,
      header(5, 5, 8, 0, 1) + chunk("IDAT", deflated(interlaced)) + kEnd,
      header(9, 2, 1, 3) + chunk("PLTE", "rgbRGB") + chunk("IDAT", deflated(std::string(6, '\0'))) + kEnd,
  };
  for (const std::string& png : pngs) EXPECT_EQ(decode(kSignature + png), "");
}

TEST(PngDecoder, WhatIsNotAdmittedIsNotDecoded) {
  const std::string png = kSignature + kHeader + chunk("IDAT", deflated(rgb_rows())) + kEnd;
  const std::vector<std::uint8_t> bytes(png.begin(), png.end());
  std::uint64_t reserved = 0;
  const ReserveBytes reserve = [&](std::uint64_t most) {
    reserved += most;
    return most <= 192 ? ok_status() : Status(Error{ErrorCode::resource_exhausted, "full", "memory"});
  };
  ASSERT_TRUE(decode_image(bytes, "p.png", 192, nullptr, reserve).ok());
  EXPECT_EQ(reserved, 192u);
  const Result<Image> large = decode_image(bytes, "p.png", 191, nullptr, reserve);
  ASSERT_FALSE(large.ok());
  EXPECT_EQ(large.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(reserved, 192u) << "what max_bytes refuses is not asked for";
}

}  // namespace
}  // namespace helio
