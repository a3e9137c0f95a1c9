// A picture of the comparison, read from its file.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio::report {

struct LoadedPicture {
  int width = 0, height = 0;
  std::vector<float> planes[3];                               // linear R, G, B; row-major, top row first
  std::optional<std::array<std::vector<float>, 3>> variance;  // of the mean, where the file has it

  PictureView view() const { return {width, height, {planes[0].data(), planes[1].data(), planes[2].data()}}; }
};

// not_found: there is no such file; invalid_argument: it is no EXR with R, G and B, or has more than 2^26 pixels.
Result<LoadedPicture> load_picture(const std::filesystem::path& file);

// Every pixel the mean of factor x factor of them, fewer at the right and lower border. factor >= 1.
LoadedPicture reduced(const LoadedPicture& picture, int factor);
std::vector<float> reduced(const std::vector<float>& plane, int width, int height, int factor);

}  // namespace helio::report
