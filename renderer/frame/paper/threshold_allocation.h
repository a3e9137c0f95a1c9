// Adaptive sampling as published (Schalk 2018, section 3.1 and Algorithm 1): one sample for every pixel whose relative
// deviation is above a threshold tau that falls with the iterations, by 1 / (max_spp - min_spp), which the text means
// where the algorithm prints an assignment. It decides by the samples that it then averages, and is biased.
//
// A pixel's samples go to half A and half B in turn, so that the mean, the variance and the error of the picture are
// those of every other mode. What Algorithm 1 calls P_variance (eq. 11 and 12) is taken over both. At iteration
// max_spp, PaperFilm::probability() becomes the probability n / max_spp that it draws from then on.
//
// After a move that carried something over (section 3.3, Algorithm 2) iterations are counted from 0, a pixel that came
// with a probability keeps it and gets no sample before max_spp, and n counts what was carried: of pixels that came
// without one it may pass max_spp, as the paper says. Where the algorithm prints P_variance = n / max_spp for every
// pixel, carried probabilities, which are calculated already, are left alone.
#pragma once

#include "renderer/film/allocation/sample_allocation.h"

namespace helio {

// Eq. 12, of a pixel with at least two samples: sqrt(variance of a sample, mean over channels) and the luminance, both
// plus epsilon, divided. +infinity with fewer.
double relative_deviation(const HalfPixel& a, const HalfPixel& b);

struct ThresholdSettings {
  std::uint32_t min_samples = 4;   // per pixel, both halves, before the threshold falls; >= 2
  std::uint32_t max_samples = 32;  // iterations until tau is 0; > min_samples
  std::uint64_t seed = 0;          // of the coin that probabilities are drawn by
};

class ThresholdAllocation final : public SampleAllocation {
 public:
  // Preconditions: those of make_allocation().
  ThresholdAllocation(Film& film, const PixelRect& region, const ThresholdSettings& settings,
                      const AllocationRequest& request)
      : SampleAllocation(film, region, 1), settings_(settings), iteration_(request.iteration), carried_(request.fill) {}

  void run(int sweep, std::size_t part) override;
  void finish_sweep(int sweep) override;

 private:
  ThresholdSettings settings_;
  std::uint32_t iteration_;
  bool carried_;  // Algorithm 2
};

}  // namespace helio
