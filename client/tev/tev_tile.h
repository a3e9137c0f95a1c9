// What tev shows of a tile: radiance, its standard error, the samples, and the layer display.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "heliograph/v1/types.pb.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

// Of tiles in this format: R, G, B; with the layer display display.R, display.G, display.B; unless they come without,
// error (standard error of the mean: root of the variance, root mean square over the channels) and samples.
std::vector<std::string> tev_channels(const heliograph::v1::TileFormat& format);

// Reads an EXR tile of that window into `planes`: window.area() floats for each of the channels, row by row, one
// channel after the other. A channel that the tile lacks is NaN. invalid_argument: it is no EXR, or of another window.
Status read_tev_tile(std::string_view exr, const PixelRect& window, const std::vector<std::string>& channels,
                     std::vector<float>& planes);

}  // namespace helio
