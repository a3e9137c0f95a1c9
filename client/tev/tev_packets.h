// The packets that tev and HDRView take over a socket. Little endian: u32 length of the whole packet, i8 type, payload;
// a string is UTF-8 and ends with NUL, a bool is a byte. The receiver answers nothing.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

// A picture in tev, known by its name. Channels are grouped by what stands before the last dot.
struct TevImage {
  std::string name;
  int width = 0, height = 0;
  std::vector<std::string> channels;

  bool operator==(const TevImage&) const = default;
};

// invalid_argument: an empty name or one with a NUL, a side outside [1, 2^20], no channel or more than 64, two of the
// same name, a channel's name that is empty, holds a NUL or begins with a digit (which would lengthen the number before
// it where a receiver reads names and sizes as text).
Status check_tev_image(const TevImage& image);

// All need an image that passes check_tev_image().

// Makes the image, in place of one of the same name. `grab_focus`: the viewer shows it.
std::string tev_create_image(const TevImage& image, bool grab_focus);

// The start of the packet that sets the pixels of `window`, which lies in the image: all but the pixels. These follow
// as window.area() floats for each channel, row by row, one channel after the other. invalid_argument: a packet of 4
// GiB or more.
Result<std::string> tev_update_image_head(const TevImage& image, const PixelRect& window);

// Replaces all vector graphics on the image by the borders of `windows`, in pixels; none: takes them away.
std::string tev_draw_borders(const TevImage& image, std::span<const PixelRect> windows);

// Takes the image out of the viewer.
std::string tev_close_image(const TevImage& image);

}  // namespace helio
