// A film as Open Image Denoise takes it, and the picture that it makes of that.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/display/oidn_library.h"

namespace helio {

class OidnImages {
 public:
  // Of films of width x height pixels. Takes bytes() less the library's own of memory. Throws std::bad_alloc.
  OidnImages(std::shared_ptr<const OidnLibrary> library, int width, int height);

  // For so many pixels: color, albedo, normal and output, and the library's own while it denoises.
  static std::size_t bytes(std::size_t pixels);

  // What follows is of this region alone, whose pixels are the whole picture for the network.
  void begin(const PixelRect& region) { region_ = region; }
  // Thread safe for windows of the region that do not overlap. Color is the mean of both halves, albedo and normal are
  // the film's features: finite, within the ranges of OidnLibrary::Images, and 0 where the film has no samples.
  void copy(const Film& film, const PixelRect& window);
  // OidnLibrary::denoise() of all that was copied.
  Status denoise(const CancelToken* cancel);

  // Linear radiance, finite, >= 0. Precondition: denoise() has made it.
  Rgb output(int x, int y) const;

 private:
  std::size_t index(int x, int y) const {
    return 3 * (std::size_t(y - region_.y0) * std::size_t(region_.width()) + std::size_t(x - region_.x0));
  }

  std::shared_ptr<const OidnLibrary> library_;
  PixelRect region_;
  std::vector<float> color_, albedo_, normal_, output_;  // three a pixel, rows of the region's width
};

}  // namespace helio
