// Pictures for the eye: exposed and sRGB-encoded PNGs, and heat maps of one value per pixel.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio {

// Factor that brings the log-average luminance (Reinhard 2002, eq. 1) of the pixels that see light to middle grey, 0.18
// linear, held to [2^-40, 2^40]. Pixels that are black, not finite, or darker than 1e-4 of the arithmetic mean do not
// count: a picture that is half empty is exposed by its other half. 1 when no pixel counts.
double auto_exposure(const PictureView& picture);

// Clamps exposure * value to [0, 1] (NaN: 0), encodes as sRGB and rounds to 8 bits: RGB, row-major, top row first.
std::vector<std::uint8_t> display_bytes(const PictureView& picture, double exposure);
// Writes them as a PNG, atomically. A description that is not empty is the file's "Description".
Status write_display_png(const std::string& path, const PictureView& picture, double exposure,
                         const std::string& description = {});

// Linear RGB in [0, 1]^3 of a map that rises evenly in lightness from near black through violet, red and orange to pale
// yellow: OkLab lightness (Ottosson 2020) is linear in t, hue turns by half a circle, chroma follows a half sine and is
// lowered where sRGB cannot show it. t is clamped to [0, 1]; NaN gives green, which the map does not contain.
Rgb heat_color(float t);

// What the ends of the map stand for.
struct HeatRange {
  float low = 0, high = 1;   // low < high; logarithmic: 0 < low
  bool logarithmic = false;  // else linear

  // 0 at low, 1 at high, clamped. Values <= 0 on a logarithmic scale give 0, +infinity 1, NaN NaN.
  float position(float value) const;
  // "1.0e-05 to 2.3e-02, logarithmic"
  std::string describe() const;
};

// Writes the heat map of width * height values, row-major, top row first, as a PNG, atomically. Title, of what the map
// shows, and range are written into the file's "Description".
Status write_heat_map_png(const std::string& path, int width, int height, const float* values, const HeatRange& range,
                          const std::string& title);

}  // namespace helio
