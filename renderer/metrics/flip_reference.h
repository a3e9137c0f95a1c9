// The reference's side of FLIP, which can be computed once and kept for all pictures that are compared with it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"
#include "renderer/metrics/flip_kernels.h"
#include "renderer/metrics/flip_observer.h"
#include "renderer/metrics/flip_options.h"
#include "renderer/metrics/flip_tone_mapping.h"

namespace helio {

// Pictures may be compared with it on several threads at once, but for keep().
class FlipReference {
 public:
  // Which FLIP of a picture will be asked for.
  struct Uses {
    bool ldr = false, hdr = false;
  };

  // Keeps nothing yet. `reference` and options.cancel outlive it. Errors: as of ldr_flip.
  static Result<FlipReference> create(const PictureView& reference, Uses uses, const FlipOptions& options = {});

  // Of all that keep() may keep: 20 bytes for each pixel and display (one for LDR, one for each exposure of HDR).
  std::uint64_t bytes() const;
  // Computes what the observer sees on as many displays as `max_bytes` hold, LDR first, then the exposures in their
  // order. Those left out are computed anew for every picture; the results are the same. Returns the bytes that are
  // held. cancelled: nothing is kept.
  Result<std::uint64_t> keep(std::uint64_t max_bytes);

  const Uses& uses() const { return uses_; }
  const PictureView& picture() const { return picture_; }
  const FlipOptions& options() const { return options_; }
  const FlipKernels& kernels() const { return kernels_; }
  const FlipExposures& exposures() const { return exposures_; }  // of uses().hdr

  // One of the displays: kLdr, or the index of an exposure, [0, exposures().different()).
  static constexpr int kLdr = -1;
  FlipDisplay display(int index) const;

  // Rows of one display from top to bottom, kept or computed. Each thread has its own.
  class Rows {
   public:
    Rows(const FlipReference& reference, int display);
    ObservedRow row(int y);

   private:
    std::size_t width_;
    const float* kept_ = nullptr;
    FlipRows computed_;
    std::optional<FlipObserver> observer_;  // of computed rows
  };

 private:
  FlipReference(const PictureView& reference, Uses uses, const FlipOptions& options);
  std::uint64_t display_bytes() const;
  std::vector<int> displays() const;
  std::vector<float> observed(int display) const;  // incomplete when it is cancelled meanwhile

  PictureView picture_;
  Uses uses_;
  FlipOptions options_;
  FlipKernels kernels_;
  FlipExposures exposures_;
  std::vector<std::vector<float>> kept_;  // by display + 1; row by row: l, a, b, edge, point. Empty: not kept
};

}  // namespace helio
