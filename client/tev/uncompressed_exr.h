// Reads uncompressed EXR scanline files in place: a tenth of what OpenEXR takes for a tile.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

class UncompressedExr {
 public:
  // Nothing is copied: `bytes` have to outlive this object. invalid_argument: the bytes are no flat scanline file of
  // one part without compression, with half and float channels that are not subsampled, or they are cut short.
  static Result<UncompressedExr> open(std::span<const std::uint8_t> bytes);

  // Relative to the corner of the display window, as of DecodedTile.
  const PixelRect& window() const { return window_; }
  // Index of a channel; -1: there is none of that name.
  int find(std::string_view name) const;
  // Row window().y0 <= y < window().y1 of a channel: window().width() floats into `out`.
  void read_row(int channel, int y, float* out) const;

 private:
  struct Channel {
    std::string_view name;
    bool is_half = false;
    std::size_t offset = 0;  // bytes from the start of a row's pixels
  };

  std::vector<Channel> channels_;
  PixelRect window_;
  std::vector<const std::uint8_t*> rows_;  // pixels of each row, from the top
};

}  // namespace helio
