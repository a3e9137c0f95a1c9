// Decides how many samples each pixel gets next: fills a film's SampleTargets for one round.
//
// Work is cut into sweeps over parts, for callers that share it between threads or must be able to stop on the way:
// for each sweep, run() of every part in any order, then finish_sweep(). The targets have the same bits however that
// was done. Two rules:
//
// NeymanAllocation (without history). A pilot of m samples of each half everywhere; then n ~ s / sqrt(c), which
// minimises the sum of s^2 / n at a given sum of c n (Neyman 1934, with costs), s: deviation of a sample in the measure
// of the picture's error, c: its cost in rays. The counts of half A come from the pilot of half B alone and the
// reverse, and stay so in every later round, which only scales them: the mean of A is unbiased whatever they are,
// because they do not depend on A's samples, nor on anything that did. s is the mean deviation of 7x7 pixels, each in
// its own measure: a pixel's own, of a pilot's few samples, would mostly add noise, and a mean of variances would
// follow single bright samples. How far the counts follow s at all is measured: of n ~ (s / sqrt(c))^g, g = 0, 1/4, ...
// 1, the one is taken under which the variance that each half has seen, at the counts that the other decides, times the
// cost is smallest; where a pilot says nothing (light that few paths find) that is uniform counts. It is one number for
// the picture, and the only one in which A's samples have a say in A's counts. Every pixel gets at least 1/8 of the
// mean count, and counts are powers of two, which Sobol points like best (a dither of one octave keeps their mean
// smooth).
//
// FillAllocation (with history). Pixels hold N samples of earlier pictures, and get n = l s / sqrt(c) - N, as a
// power of two; l is what the round can afford. There is no pilot: the first round gives as many samples as there are
// pixels to those that need them. Of pixels that carry something a share gets one all the same, a quarter of the mean
// count as long as that is below one, the same pixels in both halves, so that wrong history is seen to be wrong; later
// each gets 1/8 of the mean. s comes from history alone; where nothing is known in 7x7 pixels, s is the geometric mean
// of the picture's. Once pixels that carry nothing have four samples of each half, fresh samples are looked at, once:
// they say what c is, and s where nothing was carried, for edges between surfaces are noisier than both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/core/sample_targets.h"

namespace helio {

// FillAllocation: from this mean count per half on, half of the pixels that carry something have fresh samples.
inline constexpr double kHalfCheckedMean = 2;

// Whose mean square the allocation makes small: x - r, or (x - r) / sqrt(r^2 + 1e-2 (image mean)^2), quality.md's
// relMSE.
enum class AllocationMeasure { absolute, relative };

// One round of a rule, as a value.
struct AllocationRequest {
  // Mean count per half that the round aims at: exceeded only by what pixels have already, or get at least.
  double mean = 0;
  // Of a rule that iterates, in place of the mean: which one, counted from 0. The first one asked for is min_samples,
  // with `fill` 0.
  std::uint32_t iteration = 0;
  // What pixels have carried counts. The film has history.
  bool fill = false;

  bool operator==(const AllocationRequest&) const = default;
};

struct AllocationSettings {
  // A rule of another variant, not make_allocation()'s: its rounds, one sample a pixel at most, are iterations.
  bool iterates = false;
  AllocationMeasure measure = AllocationMeasure::relative;
  std::uint32_t min_samples = 16;  // per pixel, both halves, before counts differ; >= 2
  std::uint64_t seed = 0;          // of the dither
};

class SampleAllocation {
 public:
  virtual ~SampleAllocation() = default;
  SampleAllocation(const SampleAllocation&) = delete;
  SampleAllocation& operator=(const SampleAllocation&) = delete;

  // Of at most about 32,768 pixels each; one takes a few ms.
  std::size_t parts() const { return windows_.size(); }
  int sweeps() const { return sweeps_; }
  // Thread safe for different parts of one sweep.
  virtual void run(int sweep, std::size_t part) = 0;
  // After every part of the sweep.
  virtual void finish_sweep(int sweep) = 0;

 protected:
  SampleAllocation(Film& film, const PixelRect& region, int sweeps);

  // Notes the new targets of a part: blocks' levels, and its share of the round's sums.
  void note_targets(std::size_t part);
  // Adds the parts' sums up into the targets' round.
  void finish_round();

  Film& film_;
  PixelRect region_;
  std::vector<PixelRect> windows_;  // aligned to blocks, clipped to the region
  int sweeps_;

 private:
  std::vector<RoundSummary> sums_;  // of the parts
};

// The film, which must have targets, outlives the allocation; nobody else writes to it meanwhile. `region` meets it.
// Precondition: every pixel of the region has settings.min_samples / 2 samples of each half at the first request (with
// `fill` none), and what the round before asked for at every later one.
std::unique_ptr<SampleAllocation> make_allocation(Film& film, const PixelRect& region,
                                                  const AllocationSettings& settings, const AllocationRequest& request);

}  // namespace helio
