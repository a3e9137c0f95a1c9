// What an encoded image says about itself before a decoder is let near it: format, and size where the header gives it.
//
// Decoders allocate by what headers claim; this reads the claim from the bytes alone, without allocating, so that it
// can be refused first.
#pragma once

#include <cstdint>
#include <span>

namespace helio {

enum class ImageFormat { unknown, png, jpeg, exr, hdr, pnm, webp };

struct ImageProbe {
  ImageFormat format = ImageFormat::unknown;
  // Largest extent claimed (over all parts of an EXR), in pixels. -1: not found, which for PNG, JPEG, EXR and WebP
  // means that the header is broken; for HDR and PNM, whose headers are text, it is left to the decoder.
  std::int64_t width = -1, height = -1;
  // Largest display window of an EXR's parts; -1: there is none.
  std::int64_t display_width = -1, display_height = -1;
  double bits_per_pixel = 0;  // before compression, at least; 0: unknown
  double max_ratio = 0;       // how far the format's compression can shrink those bits
  bool deep = false;          // EXR: some part is deep
  bool cut_off = false;       // JPEG: no end-of-image marker; decoders would fill the rest with grey
  bool apple_png = false;     // "CgBI", what Xcode makes of a PNG: not the standard's format
};

ImageProbe probe_image(std::span<const std::uint8_t> bytes);

}  // namespace helio
