// The precondition that all metrics share.
#pragma once

#include <cstddef>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio {

// Ok when both have the same size of at least one pixel and finite values; else invalid_argument naming the first
// pixel that is not. The names are those in the message.
Status check_pictures(const PictureView& picture, const PictureView& reference, const char* picture_name = "picture",
                      const char* reference_name = "reference");
// The same of one picture.
Status check_picture(const PictureView& picture, const char* name);

bool all_finite(const float* values, std::size_t count);

}  // namespace helio
