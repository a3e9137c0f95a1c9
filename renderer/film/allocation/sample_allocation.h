// Decides how many samples each pixel gets next: fills a film's SampleTargets for one round.
//
// Work is cut into sweeps over parts, for callers that share it between threads or must be able to stop on the way:
// for each sweep, run() of every part in any order, then finish_sweep(). The targets have the same bits however that
// was done. Two rules:
//
// NeymanAllocation (without history). A pilot of m samples of each half everywhere; then n ~ s / sqrt(c), which
// minimises the sum of s^2 / n at a given sum of c n (Neyman 1934, with costs), s: deviation of a sample in the measure
// of the picture's error, c: its cost in rays. The counts of half A come from the pilot of half B alone and the
// reverse, and stay so in every later round, which only scales them: the mean of A is unbiased, because apart from the
// exponent g below, one number for the whole picture, A's counts depend on no sample of A. s is the mean deviation of
// 7x7 pixels, each in its own measure: a pixel's own, of a pilot's few samples, would mostly add noise, and a mean of
// variances would follow single bright samples. How far the counts follow s at all is measured: of n ~ (s / sqrt(c))^g,
// g = 0, 1/4, ... 1, the one is taken under which the variance that each half has seen, at the counts that the other
// decides, times the cost is smallest; where a pilot says nothing (light that few paths find) that is uniform counts.
// Every pixel gets at least 1/8 of the mean count, and counts are powers of two, which Sobol points like best, except
// where all are equal (a dither of one octave keeps their mean smooth).
//
// FillAllocation (with history). Pixels hold N samples of earlier pictures, and get n = l s / sqrt(c) - N, as a power
// of two; l is what the round can afford. There is no pilot: pixels that carry nothing have a sample already
// (first_samples.h), and the first round spends one sample per pixel on average, where history lacks most. A share of
// the pixels that carry something gets a sample all the same, so that wrong history is noticed: a quarter of the mean
// count as long as that is below one, the same pixels in both halves; later each gets 1/8 of the mean. s comes from
// history alone; where nothing is known in 7x7 pixels, s is the geometric mean of the picture's. Once pixels without
// history have four samples of each half, costs c, and their deviations s, are estimated again from fresh samples,
// once, because edges between surfaces are noisier than both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/base/gaze_density.h"
#include "renderer/film/core/film.h"
#include "renderer/film/core/sample_targets.h"

namespace helio {

// FillAllocation: from this mean count per half on, half of the pixels that carry something have fresh samples.
inline constexpr double kHalfCheckedMean = 2;

// Whose mean square the allocation makes small: x - r, or (x - r) / sqrt(r^2 + 1e-2 (image mean)^2), whose
// mean square is relMSE.
enum class AllocationMeasure { absolute, relative };

// One round of a rule, as a value.
struct AllocationRequest {
  // Mean count per half that the round aims at: exceeded only by what pixels have already, or get at least.
  double mean = 0;
  // Of a rule that iterates: the number of the iteration, in place of `mean`. The first one asked for is min_samples,
  // with `fill` 0.
  std::uint32_t iteration = 0;
  // Carried samples count towards the target (FillAllocation). The film has history.
  bool fill = false;

  bool operator==(const AllocationRequest&) const = default;
};

struct AllocationSettings {
  // True for a rule of another variant, where a round is an iteration of at most one sample a pixel.
  bool iterates = false;
  AllocationMeasure measure = AllocationMeasure::relative;
  std::uint32_t min_samples = 16;  // per pixel, both halves, before counts differ; >= 2
  std::uint64_t seed = 0;          // of the dither
  bool by_noise = true;            // false: counts follow `density` alone, and are uniform without one
  // Where somebody looks: counts are those of the rule times this, and a pixel's least count is a smaller share of the
  // mean. It follows no sample, so counts stay as unbiased as they are. Absent: nobody looks anywhere in particular.
  std::optional<GazeDensity> density = {};
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
