#include "renderer/metrics/check_pictures.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <sstream>

namespace helio {
namespace {

Status check_finite(const PictureView& picture, const char* name) {
  for (int c = 0; c < 3; ++c) {
    if (all_finite(picture.channels[c], picture.pixels())) continue;
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
      if (std::isfinite(picture.channels[c][i])) continue;
      std::ostringstream text;
      text << "is not finite at pixel (" << i % std::size_t(picture.width) << ", " << i / std::size_t(picture.width)
           << "), channel " << c;
      return Error{ErrorCode::invalid_argument, text.str(), name};
    }
  }
  return ok_status();
}

}  // namespace

bool all_finite(const float* values, std::size_t count) {
  // All of them, without a branch: vector instructions are faster than an early end.
  unsigned not_finite = 0;
  for (std::size_t i = 0; i < count; ++i) {
    constexpr std::uint32_t kExponent = 0x7f800000u;
    not_finite |= unsigned((std::bit_cast<std::uint32_t>(values[i]) & kExponent) == kExponent);
  }
  return not_finite == 0;
}

Status check_picture(const PictureView& picture, const char* name) {
  if (picture.width < 1 || picture.height < 1) {
    std::ostringstream text;
    text << picture.width << "x" << picture.height << "; must not be empty";
    return Error{ErrorCode::invalid_argument, text.str(), name};
  }
  return check_finite(picture, name);
}

Status check_pictures(const PictureView& picture, const PictureView& reference, const char* picture_name,
                      const char* reference_name) {
  if (picture.width < 1 || picture.height < 1 || picture.width != reference.width ||
      picture.height != reference.height) {
    std::ostringstream text;
    text << picture.width << "x" << picture.height << " against a " << reference_name << " of " << reference.width
         << "x" << reference.height << "; sizes must be equal and not empty";
    return Error{ErrorCode::invalid_argument, text.str(), picture_name};
  }
  if (Status finite = check_finite(picture, picture_name); !finite) return finite;
  return check_finite(reference, reference_name);
}

}  // namespace helio
