// Time to a given error: our side of it, and how it is put beside a peer's.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/reports/error_curve.h"
#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

// relMSE = mean((x - r)^2 / (r^2 + epsilon)).
struct ErrorGoal {
  double target = 0.01, epsilon = 0.01;
};

inline constexpr int kMitsubaStep = 4;  // samples a pass of its error curve
inline const std::vector<int> kErrorCounts = {4, 8, 12, 16, 20, 24, 28, 32, 40, 48, 64, 96, 128};

// Seconds, and beside them the ratio over the peer's seconds of the same run; the goal in seconds is what the ratio's
// goal comes to.
void add_compared(const std::string& name, const std::vector<double>& ours, const std::vector<double>& theirs,
                  double goal_ratio, Figures& figures);

// Each count is rendered from nothing, so that the time is what a caller who asks for so many samples waits. Ends with
// the count that reaches the target, or with the first picture that takes longer than most_seconds.
Result<std::vector<CurvePoint>> our_curve(const std::shared_ptr<const RenderScene>& scene, RenderEngine& engine,
                                          const RenderSettings& settings, const LoopPicture& reference,
                                          const ErrorGoal& goal, const std::vector<int>& counts = kErrorCounts,
                                          double most_seconds = 1e9);

}  // namespace helio::bench
