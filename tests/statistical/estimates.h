// Estimates for the z-tests: of a film, and of a reference that was made elsewhere.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "renderer/film/core/film.h"
#include "renderer/scene/images/image_decoder.h"
#include "tests/statistical/z_test.h"
#include "tests/support/loop_views.h"
#include "tests/support/pixel_moments.h"
#include "tests/support/shared_data.h"

namespace helio::test {

// By row; empty, with a failure of the test, where the file is not a picture of three float channels.
inline std::vector<V3d> read_pixels(const std::filesystem::path& path, int& width, int& height) {
  Result<Image> image = decode_image(read_bytes(path), path.filename().string(), 1 << 26);
  if (!image.ok() || image->format != TexelFormat::f32 || image->channels != 3) {
    ADD_FAILURE() << path << ": " << (image.ok() ? "no float rgb image" : image.error().to_string());
    return {};
  }
  width = image->width;
  height = image->height;
  std::vector<V3d> pixels;
  for (std::size_t i = 0; i < std::size_t(width) * std::size_t(height); ++i) {
    float rgb[3];
    std::memcpy(rgb, image->texels.data() + 12 * i, 12);
    pixels.emplace_back(rgb[0], rgb[1], rgb[2]);
  }
  return pixels;
}

inline Estimate estimate_of(const Film& film) {
  Estimate e{film.width(), film.height(), {}, {}};
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const PixelMoments m = moments_of(film, x, y);
      e.mean.push_back(m.mean);
      e.variance.push_back(m.variance);
    }
  }
  return e;
}

inline Estimate estimate_of(const ViewPicture& picture) {
  Estimate estimate{picture.width, picture.height, {}, {}};
  for (std::size_t i = 0; i < picture.samples.size(); ++i) {
    const auto at = [i](const std::vector<float>(&channels)[3]) {
      return V3d(channels[0][i], channels[1][i], channels[2][i]);
    };
    estimate.mean.push_back(at(picture.radiance));
    estimate.variance.push_back(at(picture.variance));
  }
  return estimate;
}

// NAME.mean.exr and NAME.variance.exr of a folder; empty, with a failure of the test, where one is missing or they do
// not fit together.
inline Estimate read_estimate(const std::filesystem::path& folder, const std::string& name) {
  Estimate estimate;
  int width = 0, height = 0;
  estimate.mean = read_pixels(folder / (name + ".mean.exr"), estimate.width, estimate.height);
  estimate.variance = read_pixels(folder / (name + ".variance.exr"), width, height);
  if (width == estimate.width && height == estimate.height) return estimate;
  ADD_FAILURE() << name << ": mean and variance differ in size";
  return {};
}

}  // namespace helio::test
