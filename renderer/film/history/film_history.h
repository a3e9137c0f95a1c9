// Temporal history of a film: for each pixel the reprojected samples with a bound on their bias, and the primary hit of
// the ray through its centre. Terms: carried: reprojected; source: a stored earlier picture; age: history length in
// camera moves; centre: primary hit of the centre ray (a G-buffer entry).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/core/film.h"
#include "renderer/film/core/packed_values.h"

namespace helio {

// The carried samples of a pixel. They are among those of the halves: HalfPixel holds `count` samples of mean `means`
// before the first fresh one.
struct CarriedPixel {
  Packed24 count[2];  // effective samples, per half; 0: nothing is carried
  PackedMeans means;  // of the halves; of one that carries nothing it means nothing
  Float24 bias2;      // square of what reuse may have added to them, mean over the channels, radiance^2
  RootByte age;       // moves since they were traced, weighted mean

  static constexpr std::uint32_t kMostCount = (1u << 24) - 1;

  // Scratch value that one sweep of a pass leaves for the next, so that no pixel changes while its neighbours are still
  // being read; < 2^14.
  std::uint16_t found() const { return notes_ & kFound; }
  void set_found(std::uint16_t what) { notes_ = std::uint16_t((notes_ & ~kFound) | what); }

  // Some of the history was interpolated between pixels of an earlier picture. False: it is this very pixel's,
  // unchanged.
  bool looked_up() const { return (notes_ & kLookedUp) != 0; }
  void note_looked_up() { notes_ |= kLookedUp; }

  // Some sample has met another surface than the pixel's centre (trace/gbuffer/partial_coverage.h).
  bool mixed() const { return (notes_ & kMixed) != 0; }
  void note_mixed() { notes_ |= kMixed; }

 private:
  static constexpr std::uint16_t kFound = 0x3fff, kLookedUp = 0x4000, kMixed = 0x8000;

  std::uint16_t notes_ = 0;
};
static_assert(sizeof(CarriedPixel) == 30);

// Primary hit of the ray through the centre of a pixel (and of the lens). It is deterministic, without stochastic
// alpha, so that two pictures of one surface agree on it.
struct CentreHit {
  float depth = std::numeric_limits<float>::infinity();  // along the view axis; +inf: it leaves the scene; NaN: unknown
  std::uint32_t instance = ~0u;                          // ~0: it leaves the scene
  std::uint32_t normal = 0;                              // geometric, towards the viewer; pack_direction()
  std::uint32_t albedo : 30 = 0;                         // pack_reflectance(), white where textures vary inside pixels
  std::uint32_t shines : 1 = 0;                          // it emits light, or is what the scene is left for
  std::uint32_t border : 1 = 0;                          // it may show another surface, too

  bool hit() const { return instance != ~0u; }
  bool known() const { return !std::isnan(depth); }
};

// The cosine of the angle, 37 degrees, up to which two normals may be of one surface.
inline constexpr float kOneSurface = 0.8f;

// Whether neighbouring pixels show one surface: both leave the scene, or their centres meet the same instance under
// normals less than 37 degrees apart.
inline bool same_surface(const CentreHit& a, const CentreHit& b) {
  if (a.instance != b.instance) return false;
  if (a.normal == b.normal || !a.hit()) return true;
  return dot(unpack_direction(a.normal), unpack_direction(b.normal)) > kOneSurface;
}

// Whether another surface lies within the filter's reach of a pixel.
enum class Border {
  none,   // its own surface
  plain,  // another one, too
  bright  // another one, and it or this one shines: a sliver of it too thin to be met would be seen
};

// Kind of the border between a pixel and a neighbour that shows another surface.
inline Border border_between(const CentreHit& here, const CentreHit& there) {
  return here.shines || there.shines ? Border::bright : Border::plain;
}

class HistorySource;

class FilmHistory {
 public:
  // Without `sources` the carried samples alone: no centre hits or earlier pictures.
  FilmHistory(int width, int height, bool sources = true);
  ~FilmHistory();

  // Nothing is carried, and what centres meet is not known.
  void clear(const PixelRect& window);
  // Whether there are centre hits.
  bool has_centres() const { return !centres_.empty(); }

  CarriedPixel& carried(int x, int y) { return carried_[index(x, y)]; }
  const CarriedPixel& carried(int x, int y) const { return carried_[index(x, y)]; }
  CentreHit& centre(int x, int y) { return centres_[index(x, y)]; }
  const CentreHit& centre(int x, int y) const { return centres_[index(x, y)]; }

  DirectionReservoir& directions(int x, int y) { return directions_[index(x, y)]; }
  const DirectionReservoir& directions(int x, int y) const { return directions_[index(x, y)]; }

  // Share of the pixel's mean that was carried, [0, 1], given the samples that the halves hold now, the carried ones
  // among them. Halves weigh alike when both have samples.
  double weight(int x, int y, std::uint32_t count_a, std::uint32_t count_b) const {
    const CarriedPixel& c = carried(x, y);
    const double share_a = count_a > 0 ? double(c.count[0]) / count_a : 0;
    const double share_b = count_b > 0 ? double(c.count[1]) / count_b : 0;
    return count_a > 0 && count_b > 0 ? 0.5 * (share_a + share_b) : share_a + share_b;
  }
  // Expected square of the error that reuse left in the pixel's mean, mean over the channels.
  double bias2(int x, int y, std::uint32_t count_a, std::uint32_t count_b) const {
    const float whole = carried(x, y).bias2;
    if (whole == 0) return 0;
    const double part = weight(x, y, count_a, count_b);
    return part * part * double(whole);
  }

  // Earlier pictures, kept for reprojection. PictureHistory (frame/stages/history_transfer.h) records which they are.
  static constexpr int kSources = 2;
  HistorySource& source(int i) { return *sources_[i]; }
  const HistorySource& source(int i) const { return *sources_[i]; }

  static std::size_t bytes_per_pixel(bool sources);
  std::size_t bytes() const;

  // Drops the carried samples of one half of a pixel; its fresh samples stay. `half`: the film's.
  void drop(int h, int x, int y, HalfPixel& half);

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_;
  std::vector<CarriedPixel> carried_;
  std::vector<CentreHit> centres_;
  std::vector<DirectionReservoir> directions_;
  std::unique_ptr<HistorySource> sources_[kSources];
};

}  // namespace helio
