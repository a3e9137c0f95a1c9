// FLIP: how different two pictures look to a person who flips between them.
#pragma once

#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"
#include "renderer/metrics/flip_options.h"

namespace helio {

class FlipReference;

struct Flip {
  std::vector<float> error;  // per pixel, row-major, top row first, each in [0, 1]; 0 for equal pictures
  double mean = 0;           // of `error`
  // Of hdr_flip, in stops: exposure e multiplies radiance by 2^e. The exposures are evenly spaced, both ends included.
  double start_exposure = 0, stop_exposure = 0;
  int exposures = 0;
};

// LDR-FLIP (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"). Both pictures are filtered
// by the contrast sensitivity of the eye, in an opponent space linear in radiance, and compared in CIELAB with the Hunt
// effect: dEc = |dL*| + sqrt(da^2 + db^2), to the power 0.7, mapped to [0, 1] by two straight lines. Edges and points
// are found by Gaussian derivatives of the luminance, for features 0.082 degrees wide: dEf = sqrt(m / sqrt(2)), m the
// larger of the changes of both. The error is dEc^(1 - dEf). Values are linear RGB and are clamped to [0, 1], the range
// of the display.
//
// Agrees with flip-evaluator 1.7 of PyPI (linear input) within 1e-4 in mean and pixels, except where errors below 0.002
// depend on the last digits of floats (tests/unit/picture/metrics/flip_evaluator_test.cpp). For large flat maps that
// evaluator prints a mean that is off by up to 0.01, because it sums in floats; its map is right.
// invalid_argument as for error_metrics.h, and for pixels_per_degree or threads out of range; cancelled.
Result<Flip> ldr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options = {});
// The same, bit for bit, with the options that the reference was made with.
Result<Flip> ldr_flip(const PictureView& picture, const FlipReference& reference);

// HDR-FLIP (Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"): in each pixel the
// largest LDR-FLIP over exposures, each multiplied in and tone mapped. The tone mapper brings the reference's largest
// luminance to 0.85 at the first exposure and its median to 0.85 at the last; there are max(2, ceil(stop - start))
// exposures. Of an even number of pixels the median is the larger of the middle ones; it and the maximum count as at
// least 2^-23, so that a picture that is mostly black has a last exposure. Values below 0 count as 0.
//
// A scale of both pictures changes nothing while the reference's median stays above 2^-23.
// Errors as for ldr_flip.
Result<Flip> hdr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options = {});
Result<Flip> hdr_flip(const PictureView& picture, const FlipReference& reference);

}  // namespace helio
