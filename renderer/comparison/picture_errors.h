// All errors of one picture against its reference.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/picture_view.h"
#include "renderer/base/pixel_disk.h"
#include "renderer/base/result.h"
#include "renderer/comparison/measures.h"

namespace helio {

class CancelToken;
class FlipReference;

// A reference, and what is known of its own noise. Pictures are of one size.
struct ReferenceView {
  PictureView mean;                           // with halves: (a + b) / 2
  std::optional<PictureView> half_a, half_b;  // independent renderings of as many samples each; both or none
  std::optional<PictureView> variance;        // of the mean's values, where there are no halves
  // Of the mean, for the FLIP measures that are asked for, with threads and cancel of its own; null: computed here.
  const FlipReference* flip = nullptr;
};

struct MeasuredRegion {
  std::string name;
  PixelRect rect;            // inside the picture, not empty
  std::optional<PixelDisk> disk = {};  // pixels whose centres are in it, in place of the rectangle's; at least one

  // Row by row.
  std::vector<std::size_t> pixels(int width, int height) const;
};

struct PictureErrorOptions {
  unsigned measures = ~0u;  // bit i: Measure(i). flicker and told_rmse are not measured here
  std::vector<MeasuredRegion> regions;
  int threads = 1;                      // that HDR-FLIP may use, [1, 64]
  const CancelToken* cancel = nullptr;  // polled between measures and at every row of FLIP; null: nobody cancels
};

// mse and relmse are free of the reference's noise where that is known: by products of its halves (metrics/
// reference_halves.h), or less its mean variance; they may then be negative. All others have it in them.
//
// Regions and the dark half have mse, relmse, bias and outlier_share relative to their own mean and of 0.1 % of their own
// pixels. Of the others, regions have those of FLIP, whose errors are those of the whole picture, and no more. A value that is not defined is left out: relmse, bias and outlier_share where the reference is
// black, outlier_share of fewer than 1,000 pixels (0.1 % is less than one of them), dssim where SSIM is not positive.
// invalid_argument as for metrics/error_metrics.h; cancelled.
Result<std::vector<MeasuredValue>> picture_errors(const PictureView& picture, const ReferenceView& reference,
                                                  const PictureErrorOptions& options = {});

// Root of the relative mean square error that the reference has itself: sqrt(mean(variance / (r^2 + epsilon))), the
// variance of r from halves ((a - b)^2 / 4) or as given, the epsilon of relative_error(). None where nothing is known
// of its noise, or where it is black.
std::optional<double> reference_error(const ReferenceView& reference);

struct WorstPixel {
  int x = 0, y = 0;
  double share = 0;  // of the picture's squared relative error, [0, 1]
};
// The `count` pixels with the largest squared relative error, the worst first; ties by row, then column. Pixels without
// error are left out; none where the reference is black. Precondition: pictures of the same size, of finite values.
std::vector<WorstPixel> worst_pixels(const PictureView& picture, const PictureView& reference, std::size_t count);

}  // namespace helio
