// What light paths bring to the film: they reach the camera at any pixel, whichever piece of work traced them.
//
// The value of a splat is what its light path alone would make of the pixel's radiance, so a pixel's mean is that over
// all light paths of the half, most of which bring it nothing (Dutre, Lafortune and Willems 1993; Veach 1997, section
// 10.3.2). The number of light paths alone normalises: sample counts may differ from pixel to pixel.
//
// Sums are fixed point in 128 bits, because the sum of doubles depends on the order, and the order on who is first. A
// value v is kept as v / P, P: the film's pixels rounded up to a power of two, so that what is stored is about the
// radiance that the splat stands for, whatever the film's size. It is rounded to a multiple of 2^-60 (8.7e-19), zero
// alone to zero: a pixel that was lit stays lit. |v / P| may be up to 2^55 (3.6e16); a sum holds 4096 of these. Squares
// of v / P are rounded up to multiples of 2^-48, and a sum of them stands still at 2^80 (1.2e24).
//
// Splats of one light path that land on the same pixel count as those of several when it comes to the variance: of
// films of a few pixels it is too small then.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>

#include "renderer/base/math.h"
#include "renderer/film/core/direction_reservoir.h"

namespace helio {

struct Splat {
  std::int32_t x = 0, y = 0;  // pixel of the film
  Rgb radiance;               // what its light path alone would make of the pixel's
  // Where its light comes from at the surface that the pixel shows, and what of it the view changes.
  ToldLight told = {};
};

class SplatBuffer {
 public:
  static constexpr std::size_t kBytesPerPixel = 196, kDirectionBytes = 16;
  static constexpr std::size_t kSumBytes = 96;  // of a pixel, per half

  // directions: that splats come from are kept, for pictures that draw on this one; kDirectionBytes a pixel more.
  SplatBuffer(int width, int height, bool directions = false);
  ~SplatBuffer();

  // Thread safe, and the sums do not depend on the order of calls. light_paths: those that the splats come from, and
  // those of the same piece of work that brought nothing. Splats outside the film, not finite or beyond the range do
  // not enter: they count as invalid, and the result is how many of these there were.
  std::uint64_t add(int half, std::span<const Splat> splats, std::uint64_t light_paths);
  // Whether it would enter.
  bool takes(const Splat& splat) const;
  // The largest value of a channel that enters a film of this size.
  static double most_radiance(int width, int height);

  std::uint64_t light_paths(int half) const { return light_paths_[half].load(std::memory_order_relaxed); }

  // What follows is thread safe too; while add() runs, some of its splats may be in and others not.

  // Columns [x0, x1) of a row, four doubles a pixel, the fourth 0: means of the half over its light paths, 0 without
  // any. variances, if not null: those of these means, as of independent light paths; 0 for fewer than two.
  void read_row(int half, int y, int x0, int x1, double* means, double* variances = nullptr) const;
  Rgb mean(int half, int x, int y) const;

  // Over both halves, the channels and columns [x0, x1) of a row: the largest sum of squares over sum, which is at most
  // the largest splat, and that where all are alike. Radiance of a splat, >= 0.
  double brightest(int y, int x0, int x1) const;

  // That of one of the half's splats on the pixel, picked with a probability proportional to its luminance, the share
  // in a byte; without any, or if none are kept: nothing is told.
  ToldLight told(int half, int x, int y) const;

  // Splats that did not enter, both halves: of a window of the film, and of those outside the film.
  std::uint64_t invalid_in(const PixelRect& window) const;
  std::uint64_t invalid_outside() const { return invalid_outside_.load(std::memory_order_relaxed); }

  // Forgets everything, in no time: rows are zeroed when they are next written to. Nobody may use the buffer meanwhile.
  void clear();

  // For copies of the film (copy/film_copy.h): rows as they lie in memory, kSumBytes a pixel and half, and splats that
  // did not enter. Nobody adds splats meanwhile. Rows that nobody has written to since clear() are to be prepared,
  // which zeroes them; thread safe.
  void prepare_rows(int y0, int y1);
  std::uint8_t* sums(int half);
  std::uint32_t* invalid() { return invalid_.get(); }
  // What is of the whole buffer.
  struct Totals {
    std::uint64_t light_paths[2] = {0, 0};
    std::uint64_t invalid_outside = 0;
    bool any_invalid = false;  // some splat within the film did not enter
  };
  Totals totals() const;
  void set_totals(const Totals& totals);

  std::size_t bytes() const;

  // To the bit.
  bool operator==(const SplatBuffer& other) const;

 private:
  struct Pixel;
  // Neighbouring rows under one lock.
  struct Stripe {
    mutable std::mutex mutex;
    std::uint64_t era = 0;  // before the buffer's: the rows hold what is of no meaning
  };
  static constexpr int kStripeRows = 4;

  std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(width_) + std::size_t(x); }
  bool is_inside(const Splat& s) const { return s.x >= 0 && s.x < width_ && s.y >= 0 && s.y < height_; }
  bool holds_anything(const Stripe& stripe) const { return stripe.era == era_; }
  void prepare(int stripe);
  bool add(int half, const Splat& splat);

  int width_, height_, stripes_;
  double pixels_;  // P
  std::uint64_t era_ = 1;
  std::unique_ptr<Stripe[]> locks_;
  std::unique_ptr<Pixel[]> halves_[2];
  std::unique_ptr<std::uint64_t[]> directions_[2];  // null: none are kept
  std::unique_ptr<std::uint32_t[]> invalid_;
  std::atomic<std::uint64_t> light_paths_[2] = {0, 0};
  std::atomic<std::uint64_t> invalid_outside_ = 0;
  std::atomic<bool> any_invalid_ = false;  // false: invalid_ is zero
};

}  // namespace helio
