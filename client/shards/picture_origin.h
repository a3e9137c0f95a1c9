// What an EXR file says about how it was made (proto/heliograph/v1/picture_origin.proto).
#pragma once

#include <string>

#include "heliograph/v1/picture_origin.pb.h"
#include "renderer/base/result.h"

namespace helio {

// For TileHeader::origin.
std::string write_origin(const heliograph::v1::PictureOrigin& origin);
// invalid_argument: the file says nothing about it, or not in this form. Fields of newer versions are ignored.
Result<heliograph::v1::PictureOrigin> read_origin(const std::string& text);

}  // namespace helio
