// Where the first samples of each pixel met the scene, for reprojection as published (Schalk 2018, sections 3.2 and
// 3.3; modes reproject and combined), and the picture that a camera leaves, from which pixels are copied into the next
// one (forward_reprojection.h).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"

namespace helio {

// First hits that a pixel may keep: the paper's one or four.
inline constexpr int kMostStoredHits = 4;
// The distance test's (3.2.2) "certain maximum distance", in sides of a pixel at the hit, so that it is the same in
// pictures of any size: a surface seen at 8 degrees is still one.
inline constexpr float kMostHitDistance = 8;

// A stored first intersection. What else eq. 15 needs of it (N, alpha, A, fr) is evaluated again where the ray meets it
// that verifies it.
struct StoredHit {
  V3f position{0, 0, 0};        // rebased scene coordinates
  std::uint32_t direction = 0;  // L, sampled there, unit, pack_direction(); of no meaning where none was
};

// What a sample found.
struct FirstHitSample {
  bool met = false;       // its camera ray met a surface; the others mean nothing where it did not
  bool directed = false;  // a direction was sampled there, and it is no delta lobe's
  V3f position{0, 0, 0}, direction{0, 0, 0};
  float footprint = 0;  // side of a pixel there, across the ray, scene units
  // Ir, of this one sample: radiance that came along the direction times its cosine over its density. What next-event
  // estimation brought from the lights at the first hit itself is no part of it.
  Rgb irradiance{0, 0, 0};
};

struct PixelHits {
  float irradiance[kHalves][3] = {};  // mean over the valid samples of each half
  std::uint8_t met = 0;               // bit k: stored hit k is there
  std::uint8_t directed = 0;          // bit k: and has a direction
  bool settled : 1 = false;  // was reprojected: keeps the hits that came with it, "stored when not yet reprojected"
  bool edge : 1 = false;     // samples of the pixel met points further apart than the distance test allows
  bool begun : 1 = false;    // the first sample was valid
};

class LeftPicture;

class FirstHits {
 public:
  // per_pixel: 1 or 4.
  FirstHits(int width, int height, int per_pixel);
  ~FirstHits();

  int per_pixel() const { return per_pixel_; }
  PixelHits& pixel(int x, int y) { return pixels_[index(x, y)]; }
  const PixelHits& pixel(int x, int y) const { return pixels_[index(x, y)]; }
  std::span<StoredHit> hits(int x, int y) {
    return {hits_.data() + index(x, y) * std::size_t(per_pixel_), std::size_t(per_pixel_)};
  }
  std::span<const StoredHit> hits(int x, int y) const {
    return {hits_.data() + index(x, y) * std::size_t(per_pixel_), std::size_t(per_pixel_)};
  }

  // The sample of that index of a half, which is the count-th valid one of it. Stored are, in this order, the first
  // samples of half A and of half B and the second of each, as many as fit.
  void add(int half, std::uint32_t index, std::uint32_t count, int x, int y, const FirstHitSample& sample);

  void clear(const PixelRect& window);

  LeftPicture& left() { return *left_; }
  const LeftPicture& left() const { return *left_; }

  static constexpr std::size_t bytes_per_pixel(int per_pixel);
  std::size_t bytes() const;

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, per_pixel_;
  std::vector<PixelHits> pixels_;
  std::vector<StoredHit> hits_;
  std::unique_ptr<LeftPicture> left_;
};

// Copies of a film's pixels, and who asks for which pixel of the next picture.
class LeftPicture {
 public:
  // Counts, colour moments and probability travel with the pixel (3.3).
  struct Pixel {
    HalfPixel half[kHalves];
    PixelFeatures features;
    PixelHits hits;
    float probability = 0;  // of a further sample; 0: not calculated yet
    float age = 0;          // moves, mean over the samples
  };

  LeftPicture(int width, int height, int per_pixel);

  // Its camera, while the film itself does not hold the picture any more; none: it does, or the copy is of no use.
  std::optional<CameraPose> pose;

  // Takes over a window of the film, which has first hits and history, and withdraws all bids for its pixels. Thread
  // safe for disjoint windows.
  void gather(const Film& film, const PixelRect& window);

  const Pixel& pixel(int x, int y) const { return pixels_[index(x, y)]; }
  std::span<const StoredHit> hits(int x, int y) const {
    return {hits_.data() + index(x, y) * std::size_t(per_pixel_), std::size_t(per_pixel_)};
  }

  // Pixel (from_x, from_y) of this picture asks for pixel (x, y) of the next; `distance` > 0 of the surface there. The
  // nearest gets it, of several the first in the picture: the outcome does not depend on the order. Thread safe.
  void bid(int x, int y, float distance, int from_x, int from_y);
  void withdraw_bids(const PixelRect& window);
  // Fills a pixel of the film, which has been cleared, with the one that got it. Halves are swapped, so that a camera
  // that moves on after every sample, which is always one of the first half, feeds both. Returns the samples; 0: nobody
  // asked.
  std::uint64_t place(Film& film, int x, int y) const;

  std::size_t bytes() const;
  static constexpr std::size_t bytes_per_pixel(int per_pixel) {
    return sizeof(Pixel) + std::size_t(per_pixel) * sizeof(StoredHit) + sizeof(std::uint64_t);
  }

 private:
  static constexpr std::uint64_t kNoBid = ~std::uint64_t(0);
  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }

  int width_, per_pixel_;
  std::vector<Pixel> pixels_;
  std::vector<StoredHit> hits_;
  std::vector<std::uint64_t> bids_;  // by pixel of the next picture: the distance's bits, then the pixel that asks
};

constexpr std::size_t FirstHits::bytes_per_pixel(int per_pixel) {
  return sizeof(PixelHits) + std::size_t(per_pixel) * sizeof(StoredHit) + LeftPicture::bytes_per_pixel(per_pixel);
}

}  // namespace helio
