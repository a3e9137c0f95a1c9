// Which of a pixel's samples is to blame where the pixel is far from its reference.
#pragma once

#include <optional>

#include "renderer/base/cancel.h"
#include "renderer/frame/frame_sink.h"

namespace helio {

// Traces the pixel's samples again and gives the one of the largest luminance, those that are not finite first.
// `samples`: that the pixel has in both halves. Nothing: integrators with light paths, modes that carry samples over,
// the paper's variant, more than 4096 samples, or cancelled.
std::optional<InvalidSample> brightest_sample(const RenderScene& scene, const FrameBegin& frame, int x, int y,
                                              float samples, const CancelToken& cancel);

}  // namespace helio
