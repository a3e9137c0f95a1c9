// What reuse has brought into the pixels of a film, and where their centres look.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

// The carried samples of a pixel. They are among those of the halves: HalfPixel holds `count` samples of mean `mean`
// before the first fresh one.
struct CarriedPixel {
  float mean[2][3] = {};         // per half
  float bias2 = 0;               // square of what reuse may have added to `mean`, mean over the channels, radiance^2
  std::uint32_t count : 24 = 0;  // effective samples of each half; 0: nothing is carried
  std::uint32_t age : 8 = 0;     // moves since they were traced, weighted mean, rounded up; 255: that or more

  static constexpr std::uint32_t kMostCount = (1u << 24) - 1;
};

// What the ray through the centre of a pixel (and of the lens) meets. Without alpha's chance and without noise, so that
// two pictures of the same surface agree on it.
struct CentreHit {
  float depth = std::numeric_limits<float>::infinity();  // along the view axis; +inf: it leaves the scene
  std::uint32_t instance = ~0u;                          // ~0: it leaves the scene
  std::uint32_t normal = 0;                              // geometric, towards the viewer; pack_direction()
  std::uint32_t albedo = 0;                              // pack_reflectance()

  bool hit() const { return instance != ~0u; }
};

class HistorySource;

class FilmHistory {
 public:
  FilmHistory(int width, int height);
  ~FilmHistory();

  CarriedPixel& carried(int x, int y) { return carried_[index(x, y)]; }
  const CarriedPixel& carried(int x, int y) const { return carried_[index(x, y)]; }
  CentreHit& centre(int x, int y) { return centres_[index(x, y)]; }
  const CentreHit& centre(int x, int y) const { return centres_[index(x, y)]; }

  // The weight that what was carried has in the pixel's mean, [0, 1], given the samples that the halves hold now, the
  // carried ones among them.
  double weight(int x, int y, std::uint32_t count_a, std::uint32_t count_b) const {
    const double n = carried(x, y).count;
    return 0.5 * (n / std::max<std::uint32_t>(count_a, 1) + n / std::max<std::uint32_t>(count_b, 1));
  }
  // Expected square of the error that reuse left in the pixel's mean, per channel (mean over the channels); counts as
  // above.
  double bias2(int x, int y, std::uint32_t count_a, std::uint32_t count_b) const {
    const CarriedPixel& c = carried(x, y);
    if (c.count == 0) return 0;
    const double share = weight(x, y, count_a, count_b);
    return share * share * c.bias2;
  }

  // Earlier pictures that later ones draw on: what they are is their user's to know.
  static constexpr int kSources = 2;
  HistorySource& source(int i) { return *sources_[i]; }
  const HistorySource& source(int i) const { return *sources_[i]; }

  static std::size_t bytes_per_pixel();
  std::size_t bytes() const;

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_;
  std::vector<CarriedPixel> carried_;
  std::vector<CentreHit> centres_;
  std::unique_ptr<HistorySource> sources_[kSources];
};

}  // namespace helio
