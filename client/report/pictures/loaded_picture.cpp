#include "client/report/pictures/loaded_picture.h"

#include <algorithm>
#include <string>

#include "renderer/codec/tile_codec.h"

namespace helio::report {
namespace {

constexpr std::uint64_t kMaxPixels = std::uint64_t(1) << 26;

// The three channels of that prefix, if the file has all.
std::optional<std::array<std::vector<float>, 3>> take_channels(const DecodedTile& file, const std::string& prefix) {
  std::array<std::vector<float>, 3> planes;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float>* found = file.find(prefix + "RGB"[c]);
    if (!found) return std::nullopt;
    planes[c] = *found;
  }
  return planes;
}

}  // namespace

Result<LoadedPicture> load_picture(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{ErrorCode::not_found, "there is no such file", file.string()};
  }
  const Result<DecodedTile> decoded = read_exr(file.string(), kMaxPixels);
  if (!decoded) return decoded.error();
  auto planes = take_channels(*decoded, "");
  if (!planes) return Error{ErrorCode::invalid_argument, "lacks a channel R, G or B", file.string()};
  LoadedPicture picture;
  picture.width = decoded->header.data_window.width();
  picture.height = decoded->header.data_window.height();
  for (std::size_t c = 0; c < 3; ++c) picture.planes[c] = std::move((*planes)[c]);
  picture.variance = take_channels(*decoded, "variance.");
  return picture;
}

std::vector<float> reduced(const std::vector<float>& plane, int width, int height, int factor) {
  std::vector<float> out;
  for (int y = 0; y < height; y += factor) {
    for (int x = 0; x < width; x += factor) {
      double sum = 0;
      const int right = std::min(width, x + factor), bottom = std::min(height, y + factor);
      for (int row = y; row < bottom; ++row) {
        for (int column = x; column < right; ++column)
          sum += plane[std::size_t(row) * std::size_t(width) + std::size_t(column)];
      }
      out.push_back(float(sum / ((right - x) * (bottom - y))));
    }
  }
  return out;
}

LoadedPicture reduced(const LoadedPicture& picture, int factor) {
  LoadedPicture out;
  out.width = (picture.width + factor - 1) / factor;
  out.height = (picture.height + factor - 1) / factor;
  for (std::size_t c = 0; c < 3; ++c) out.planes[c] = reduced(picture.planes[c], picture.width, picture.height, factor);
  return out;
}

}  // namespace helio::report
