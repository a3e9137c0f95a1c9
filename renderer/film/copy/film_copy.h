// Copies of what a film holds of a region, as one row of bytes that can be stored: plane after plane, row by row, each
// number as it lies in memory (little-endian).
//
// Planes, in this order: the halves, features, work of blocks; with targets their codes and demands; with splats their
// sums and the invalid ones; counts of invalid samples, if there are any. Not among them: the few numbers that are of
// the whole film (light tiles, light paths, sums of the round).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/film/core/film.h"

namespace helio {

class FilmCopy {
 public:
  // Films with history, exact targets or an extension are not copied.
  static bool covers(const FilmState& state);

  // Of a film of this size and state. splats: what light paths brought (Film::splats() is not null). invalid: some
  // sample was not finite (Film::any_invalid()). Preconditions: covers(state), the region lies in the film.
  FilmCopy(int width, int height, const FilmState& state, const PixelRect& region, bool splats, bool invalid);

  std::uint64_t bytes() const { return bytes_; }
  // The region, out to whole blocks of the film.
  const PixelRect& window() const { return window_; }

  // Parts of about 32,000 pixels, which several threads may copy at once: a millisecond or two each. Nobody else uses
  // the film meanwhile. Both films have the size and the state of the copy.
  std::size_t parts() const { return parts_.size(); }
  // Zeroes splats of rows that no light path has reached, so that they can be copied.
  void save(Film& film, std::size_t part, std::uint8_t* to) const;
  void load(const std::uint8_t* from, std::size_t part, Film& film) const;

  // Samples that a pixel of the window has had in a copy, invalid ones among them.
  std::uint32_t attempted(const std::uint8_t* from, int half, int x, int y) const;
  // That the pixel aims at in the round, of a film with targets. uniform: SampleTargets::uniform.
  std::uint32_t target(const std::uint8_t* from, int half, int x, int y, std::uint32_t uniform) const;
  // Whether load() makes a film of the bytes that nothing stumbles over: sums are finite, counts within 2^31, codes of
  // targets ones that there are. The error names the pixel.
  Status check(const std::uint8_t* from) const;

 private:
  // In the order in which they are stored; of two halves A comes first.
  enum Kind {
    kHalfA,
    kHalfB,
    kFeatures,
    kWorkA,
    kWorkB,
    kCodesA,
    kCodesB,
    kDemandA,
    kDemandB,
    kSplatsA,
    kSplatsB,
    kInvalidSplats,
    kInvalidA,
    kInvalidB,
    kKinds
  };
  struct Plane {
    std::size_t element = 0;   // bytes; 0: there is no such plane
    int side = 1;              // of what an element stands for, pixels
    std::uint64_t offset = 0;  // in the copy
  };

  static std::array<std::uint8_t*, kKinds> memory_of(Film& film, bool invalid);
  std::uint64_t at(Kind kind, int x, int y) const;
  template <class Copy>
  void for_rows(std::size_t part, const Copy& copy) const;

  int width_;
  PixelRect window_;
  bool splats_, invalid_;
  std::array<Plane, kKinds> planes_;
  std::uint64_t bytes_ = 0;
  std::vector<PixelRect> parts_;
};

}  // namespace helio
