// Differences of a picture from its reference: maps of one byte a pixel, with their colours.
#pragma once

#include <string>
#include <vector>

#include "client/report/pictures/loaded_picture.h"
#include "client/report/pictures/png_bytes.h"
#include "renderer/base/result.h"

namespace helio::report {

struct DifferenceMap {
  int width = 0, height = 0;
  std::vector<float> values;  // in [0, 1]: the place in the palette
};

// HDR-FLIP of each pixel, with its mean and weighted median. Errors as of hdr_flip().
struct FlipMap {
  DifferenceMap map;
  double mean = 0, median = 0;
};
Result<FlipMap> flip_map(const LoadedPicture& picture, const LoadedPicture& reference);

// Signed, of luminances x and r, 0.5: equal. Where both files have variances, the difference over its standard error,
// from -5 to 5; else (x - r) / sqrt(r^2 + 0.01 mean(r)^2), from -1 to 1. Precondition: of one size.
struct SignedMap {
  DifferenceMap map;
  bool standard_errors = false;
};
inline constexpr double kSignedMapErrors = 5, kSignedMapShare = 1;  // at the ends
SignedMap signed_map(const LoadedPicture& picture, const LoadedPicture& reference);

// Pixels of factor x factor as one, their mean.
DifferenceMap reduced(const DifferenceMap& map, int factor);

// From near black over red to pale yellow, as heat maps of this project are.
const Palette& flip_palette();
// Blue where the picture is darker than its reference, near white at 0, red where it is brighter.
const Palette& signed_palette();

std::vector<std::uint8_t> to_png(const DifferenceMap& map, const Palette& palette);

}  // namespace helio::report
