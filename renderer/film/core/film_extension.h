// Per-pixel state that a film keeps for code above it: allocated, cleared, counted and freed with the film, which does
// not know what it is.
#pragma once

#include <cstddef>
#include <memory>

#include "renderer/base/math.h"

namespace helio {

class FilmExtension {
 public:
  virtual ~FilmExtension() = default;

  // As Film::clear().
  virtual void clear(const PixelRect& window) = 0;
  // The film's pixels are of no use to any later picture.
  virtual void forget() = 0;
  virtual std::size_t bytes() const = 0;
};

// A constant of whoever defines the extension: two films have the same one when they have the same pointer.
struct FilmExtensionKind {
  std::size_t bytes_per_pixel;
  std::unique_ptr<FilmExtension> (*make)(int width, int height);
};

}  // namespace helio
