#include "client/report/pictures/png_bytes.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "renderer/base/check.h"
#include "renderer/codec/checksum.h"

namespace helio::report {
namespace {

constexpr int kLevel = 7;                       // higher ones save 1 % of noisy pictures, in several times the time
constexpr std::uint8_t kRgb = 2, kIndexed = 3;  // colour types of PNG

void append_number(std::vector<std::uint8_t>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(std::uint8_t(value >> shift));
}

void append_chunk(std::vector<std::uint8_t>& out, std::string_view type, std::span<const std::uint8_t> data) {
  append_number(out, std::uint32_t(data.size()));
  const std::size_t begin = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  append_number(out, crc32_of(out.data() + begin, out.size() - begin));
}

std::uint8_t paeth(int left, int up, int corner) {
  const int guess = left + up - corner;
  const int a = std::abs(guess - left), b = std::abs(guess - up), c = std::abs(guess - corner);
  return std::uint8_t(a <= b && a <= c ? left : b <= c ? up : corner);
}

// The row behind the number of its filter, the one whose differences are smallest: none, left, up, mean or Paeth.
void append_filtered_row(std::vector<std::uint8_t>& out, std::span<const std::uint8_t> row,
                         std::span<const std::uint8_t> above, std::size_t pixel_bytes) {
  std::vector<std::uint8_t> best, tried(row.size());
  long least = -1;
  for (std::uint8_t filter = 0; filter < 5; ++filter) {
    long sum = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int left = i < pixel_bytes ? 0 : row[i - pixel_bytes], up = above[i];
      const int corner = i < pixel_bytes ? 0 : above[i - pixel_bytes];
      const int guesses[] = {0, left, up, (left + up) / 2, paeth(left, up, corner)};
      tried[i] = std::uint8_t(row[i] - guesses[filter]);
      sum += std::abs(int(std::int8_t(tried[i])));
    }
    if (least >= 0 && sum >= least) continue;
    least = sum;
    best = tried;
    best.insert(best.begin(), filter);
  }
  out.insert(out.end(), best.begin(), best.end());
}

std::vector<std::uint8_t> make_png(int width, int height, std::uint8_t color_type,
                                   std::span<const std::uint8_t> palette, std::span<const std::uint8_t> rows) {
  static constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  std::vector<std::uint8_t> out(std::begin(kSignature), std::end(kSignature)), header;
  append_number(header, std::uint32_t(width));
  append_number(header, std::uint32_t(height));
  for (const std::uint8_t byte : {std::uint8_t(8), color_type, std::uint8_t(0), std::uint8_t(0), std::uint8_t(0)}) {
    header.push_back(byte);  // bits a channel, colour, compression, filters, interlacing
  }
  append_chunk(out, "IHDR", header);
  if (!palette.empty()) append_chunk(out, "PLTE", palette);
  append_chunk(out, "IDAT", zlib_bytes(rows));
  append_chunk(out, "IEND", {});
  return out;
}

}  // namespace

std::vector<std::uint8_t> zlib_bytes(std::span<const std::uint8_t> bytes) {
  struct Free {
    void operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }
  };
  const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(kLevel));
  HELIO_CHECK(compressor != nullptr);
  std::vector<std::uint8_t> out(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
  out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

std::vector<std::uint8_t> png_of_rgb(int width, int height, std::span<const std::uint8_t> rgb) {
  const std::size_t row_bytes = 3 * std::size_t(width);
  HELIO_CHECK(rgb.size() == row_bytes * std::size_t(height));
  const std::vector<std::uint8_t> nothing(row_bytes);
  std::vector<std::uint8_t> rows;
  rows.reserve(rgb.size() + std::size_t(height));
  for (std::size_t y = 0; y < std::size_t(height); ++y) {
    const std::span<const std::uint8_t> above = y == 0 ? nothing : rgb.subspan((y - 1) * row_bytes, row_bytes);
    append_filtered_row(rows, rgb.subspan(y * row_bytes, row_bytes), above, 3);
  }
  return make_png(width, height, kRgb, {}, rows);
}

std::vector<std::uint8_t> png_of_indices(int width, int height, std::span<const std::uint8_t> indices,
                                         const Palette& palette) {
  HELIO_CHECK(indices.size() == std::size_t(width) * std::size_t(height));
  std::vector<std::uint8_t> rows, colors;
  rows.reserve(indices.size() + std::size_t(height));
  for (std::size_t at = 0; at < indices.size(); at += std::size_t(width)) {
    rows.push_back(0);  // no filter: differences of indices mean nothing
    rows.insert(rows.end(), indices.begin() + long(at), indices.begin() + long(at + std::size_t(width)));
  }
  for (const auto& color : palette) colors.insert(colors.end(), color.begin(), color.end());
  return make_png(width, height, kIndexed, colors, rows);
}

}  // namespace helio::report
