// One look at a row of the film: the pixels' means, and the terms of which their variance is pooled (variance_pool.h).
// Splats are part of both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/history/splat_row.h"

namespace helio {

// Kept from row to row, for its memory and for the divisions.
class PixelRow {
 public:
  // Columns [x0, x1) of row y. Terms of a film whose counts differ are those of a single sample: times n of 1 / n =
  // (1 / n_A + 1 / n_B) / 4, so that neighbours can be pooled. Terms are four floats a pixel, the fourth 1 where they
  // are defined; pixels without are four zeroes. Null: not wanted. They are left alone where no pixel of the row has
  // any.
  void look(const Film& film, int y, int x0, int x1, float* differences = nullptr, float* spreads = nullptr);

  bool any_paired() const { return any_paired_; }      // some pixel has samples in both halves, and so a difference
  bool any_spread() const { return any_spread_; }      // some pixel has two or more in both, and so a spread
  bool any_unpaired() const { return any_unpaired_; }  // some pixel lacks a half

  // n as above, of columns [from, to); 0 where a half has no samples.
  void copy_counts(int from, int to, float* out) const;
  // Of all pixels and channels.
  double sum_of_means() const;
  // Four floats a pixel: channels of at most `largest`, and 1.
  void copy_means(float largest, float* out) const;
  // Columns [from, to), which must have been looked at.
  void append_means(int from, int to, std::vector<float> (&channels)[3]) const;
  void append_samples(int from, int to, std::vector<float>& samples) const;  // valid ones, both halves

 private:
  // Neighbours that have the same numbers of samples.
  struct Run {
    int begin = 0, end = 0;  // from x0
    std::uint32_t count[kHalves] = {};

    bool paired() const { return count[0] > 0 && count[1] > 0; }
    bool spread() const { return count[0] > 1 && count[1] > 1; }
  };
  // What the counts of a run make of its sums.
  struct Weights {
    std::uint32_t count[kHalves] = {0, 0};
    double mean[kHalves] = {0, 0};    // mean of the pixel: sum[0] mean[0] + sum[1] mean[1]
    double half[kHalves] = {0, 0};    // what a half's mean weighs in it
    double spread[kHalves] = {0, 0};  // 1 / (4 count (count - 1)), times `scale`
    double scale = 1;                 // n of a film whose counts differ

    void update(const std::uint32_t (&counts)[kHalves], bool counts_differ);
  };

  void find_runs(const HalfPixel* a, const HalfPixel* b);
  void look_at_splats(const Film& film, int y, bool spreads);
  // Of a pixel, to the parts that the halves have in the mean.
  template <class V>
  void add_splats(int x, V& part_a, V& part_b) const;
  template <bool kSplats>
  void write(const HalfPixel* a, const HalfPixel* b, float* differences, float* spreads);
  template <bool kSplats>
  void write_means(const Run& run, const HalfPixel* a, const HalfPixel* b);
  template <bool kSplats, bool kSpread>
  void write_terms(const Run& run, const HalfPixel* a, const HalfPixel* b, float* differences, float* spreads);

  int x0_ = 0, x1_ = 0;
  bool counts_differ_ = false;
  std::ptrdiff_t next_row_ = 0;  // pixels to the row below; it is fetched early, because it is looked at next
  bool any_paired_ = false, any_spread_ = false, any_unpaired_ = false;
  Weights weights_;
  std::vector<Run> runs_;
  std::vector<float> means_;  // four floats a pixel, the fourth of no meaning
  SplatRow splats_[kHalves];
  // Of a film with splats, four doubles a pixel: what they and their part of the deviations add to the spread.
  std::vector<double> splat_spreads_;
};

}  // namespace helio
