// Resident per-pixel state of one picture: two independent half buffers and the first-hit features.
//
// Each half has its own scramble of the Sobol sequence, so mean A and mean B are independent estimates of the same
// picture. Sums are double and samples are added one by one in index order by one worker per pixel, so the bits do not
// depend on how the work was cut.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/film/core/invalid_counts.h"
#include "renderer/film/core/light_tiles.h"

namespace helio {

inline constexpr int kHalves = 2;
// Side in pixels of the blocks, aligned to the film, whose paths are traced together.
inline constexpr int kFilmBlock = 16;

// x rounded up or down to a float with a probability that makes its expectation exact: rounded to nearest, sums and
// means alike lose what is below half a unit of their last digit, always the same way (a float sum of 0.6 is 0.3 % off
// after 65,536 terms). The error is a random walk instead, of about 1e-8 sqrt(count). See Croci et al. 2022,
// "Stochastic rounding: implementation, error analysis and applications". The random number is a Weyl sequence over the
// count, so the bits are those of the samples. |x| below the largest float.
inline float round_stochastically(double x, std::uint32_t count) {
  constexpr std::uint64_t kDropped = (std::uint64_t(1) << 29) - 1;  // digits that a double has and a float has not
  return float(std::bit_cast<double>((std::bit_cast<std::uint64_t>(x) + (count * 0x9e3779b1u >> 3)) & ~kDropped));
}

// One half of one pixel. count is the number of valid samples; invalid ones never enter. Small, because resolving a
// film is bound by reading it.
struct HalfPixel {
  double sum[3] = {0, 0, 0};
  float deviations[3] = {0, 0, 0};  // sum over the samples of (x - mean)^2, at most 2^127
  std::uint32_t count = 0;

  void add(const Rgb& radiance) {
    // Of n samples that become n + 1: (x - mean)^2 n / (n + 1) is added (Welford 1962, eq. I).
    constexpr double kLargest = 0x1p127;
    const double n = count, scale = count > 0 ? 1 / (n * (n + 1)) : 0;
    ++count;
    for (int c = 0; c < 3; ++c) {
      const double x = radiance[c], off = x * n - sum[c];
      const double grown = deviations[c] + off * off * scale;
      deviations[c] = round_stochastically(grown < kLargest ? grown : kLargest, count);
      sum[c] += x;
    }
  }
  double sum_squares(int c) const { return count > 0 ? deviations[c] + sum[c] * sum[c] / count : 0; }
};

// First-hit features. Albedo, normal and hits are over all samples of half A; the others are those of its first sample,
// which is what reprojection needs: one consistent surface point. Before that sample a pixel that was carried has those
// of its centre.
struct PixelFeatures {
  float albedo[3] = {0, 0, 0};    // mean hemispherical reflectance of the first hit, environment: 0
  float normal[3] = {0, 0, 0};    // mean of world-space shading normals, environment: 0
  std::uint32_t count = 0;        // samples in the two means
  std::uint32_t hits = 0;         // of these; hits / count is alpha
  float depth = 0;                // distance along the first sample's ray to its hit, +inf: miss
  std::uint32_t primitive = ~0u;  // of what that hit; ~0: miss

  void add(const Rgb& sample_albedo, const V3f& sample_normal, bool hit) {
    ++count;
    hits += hit ? 1 : 0;
    const double weight = 1.0 / count;
    for (int c = 0; c < 3; ++c) {
      albedo[c] = round_stochastically(albedo[c] + (double(sample_albedo[c]) - albedo[c]) * weight, count);
      normal[c] = round_stochastically(normal[c] + (double(sample_normal[c]) - normal[c]) * weight, count);
    }
  }
};

// What one half's samples of a block of kFilmBlock x kFilmBlock pixels have cost. Rays are counted, not seconds: the
// same on every machine and in every run.
struct BlockWork {
  std::uint64_t rays = 0, paths = 0;
  double bias = 0;  // sum over samples, luminance: what merging adds by estimate (merging_bias.h)
};

class FilmExtension;
class FilmHistory;
class SampleTargets;
class SplatBuffer;
struct FilmExtensionKind;

// What a film holds beside its halves and features.
struct FilmState {
  bool targets = false;       // SampleTargets: fresh samples differ from pixel to pixel
  bool exact_counts = false;  // and targets may be any number, not powers of two alone
  bool history = false;       // FilmHistory: samples of earlier pictures are among the pixels'
  bool carried_only = false;  // history without centre hits, directions and sources: only CarriedPixel
  bool splats = false;        // SplatBuffer: light paths reach the camera at any pixel
  bool merging = false;       // light paths are merged with camera paths: BlockWork::bias
  const FilmExtensionKind* extension = nullptr;  // FilmExtension; null: none

  bool counts_differ() const { return targets || history; }
  bool operator==(const FilmState&) const = default;
};

class Film {
 public:
  // 120 bytes, and 8 more once any sample was not finite. Added: targets 6 (exact_counts: 8); history 194, which is 58
  // and two sources of 68 (carried_only: 30); splats 196 (with sources: 212); and the extension's own.
  static std::size_t bytes_per_pixel(const FilmState& state);

  explicit Film(int width, int height, const FilmState& state = {});
  ~Film();
  Film(Film&&) noexcept;
  Film& operator=(Film&&) noexcept;

  int width() const { return width_; }
  int height() const { return height_; }
  PixelRect bounds() const { return {0, 0, width_, height_}; }
  std::size_t bytes() const;

  HalfPixel& half(int h, int x, int y) { return halves_[h][index(x, y)]; }
  const HalfPixel& half(int h, int x, int y) const { return halves_[h][index(x, y)]; }
  PixelFeatures& features(int x, int y) { return features_[index(x, y)]; }
  const PixelFeatures& features(int x, int y) const { return features_[index(x, y)]; }

  // Samples of one half of a pixel that were not finite. Apart, for they are rare.
  std::uint32_t invalid(int h, int x, int y) const { return invalid_.at(h, index(x, y)); }
  void add_invalid(int h, int x, int y, std::uint32_t samples = 1);
  // Valid and invalid ones that were traced for this picture: the index of the pixel's next sample of this half.
  std::uint32_t attempted(int h, int x, int y) const {
    const std::size_t i = index(x, y);
    const std::uint32_t count = halves_[h][i].count + invalid_.at(h, i);
    return history_ ? count - carried(h, x, y) : count;
  }
  std::uint64_t invalid_in(const PixelRect& window) const;  // both halves
  bool any_invalid() const { return invalid_.any(); }       // since the film was made

  // Of one half of the block that holds the pixel. Thread safe, and the sums do not depend on the order.
  void add_work(int h, int x, int y, std::uint64_t rays, std::uint64_t paths);
  BlockWork work(int h, int x, int y) const;
  // The same for BlockWork::bias; its last bits depend on the order of those who share a block.
  void add_merging_bias(int h, int x, int y, double bias);

  const FilmState& state() const { return state_; }
  SampleTargets* targets() { return targets_.get(); }  // null: none
  const SampleTargets* targets() const { return targets_.get(); }
  FilmHistory* history() { return history_.get(); }  // null: none
  const FilmHistory* history() const { return history_.get(); }
  FilmExtension* extension() { return extension_.get(); }  // null: none
  const FilmExtension* extension() const { return extension_.get(); }
  // Null: the film has no splats, or every light tile is off. A half's mean is that of its samples plus its splats
  // times the share of its samples that is not carried (splat_row.h); a half without samples has no mean.
  SplatBuffer* splats() { return splats_off_ ? nullptr : splats_.get(); }
  const SplatBuffer* splats() const { return splats_off_ ? nullptr : splats_.get(); }
  // Tiles rendered with light paths, for integrators that trace any. Null: all tiles; with pt+bdpt: no tile. Kept by
  // clear(). To be set before the first sample: in other tiles splats are dropped, for those pixels' samples already
  // stand for all light.
  const std::shared_ptr<const LightTiles>& light_tiles() const { return light_tiles_; }
  void set_light_tiles(std::shared_ptr<const LightTiles> tiles) {
    splats_off_ = tiles && !tiles->any();
    light_tiles_ = std::move(tiles);
  }

  void clear();
  // Only a window, which must lie inside. Splats are kept even there, because they are normalised over the whole film.
  void clear(const PixelRect& window);

 private:
  friend class FilmCopy;  // copy/film_copy.h: the arrays below, as bytes

  std::size_t index(int x, int y) const { return std::size_t(y) * width_ + x; }

  std::uint32_t carried(int h, int x, int y) const;

  BlockWork& block(int h, int x, int y) {
    return work_[h][std::size_t(y / kFilmBlock) * std::size_t(block_columns_) + std::size_t(x / kFilmBlock)];
  }

  int width_, height_, block_columns_;
  FilmState state_;
  std::vector<HalfPixel> halves_[kHalves];
  std::vector<PixelFeatures> features_;
  InvalidCounts invalid_;
  std::vector<BlockWork> work_[kHalves];
  std::unique_ptr<SampleTargets> targets_;
  std::unique_ptr<FilmHistory> history_;
  std::unique_ptr<SplatBuffer> splats_;
  std::unique_ptr<FilmExtension> extension_;
  std::shared_ptr<const LightTiles> light_tiles_;
  bool splats_off_ = false;
};

}  // namespace helio
