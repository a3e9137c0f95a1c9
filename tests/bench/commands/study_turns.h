// `helio_bench study --turns`: the reprojection part of Schalk's study (2018, chapters 4.3 and 4.4). A camera turns by
// 100 degrees in equal steps, with so many samples at each, and what the last view's error is from then on is held
// against plain path tracing, which starts over there.
#pragma once

#include "tests/bench/commands/study.h"

namespace helio::bench {

// Plain path tracing first; reprojection as published with one and four stored hits, with four also by the two larger
// bounds of chapter 4.3; its combination with adaptive sampling by the settings that chapter 4.4 takes; ours.
std::vector<StudyMode> turn_modes();

// One result for each scene, step (options.step_degrees) and number of samples a step (options.step_samples). Its
// curves are of the last view at 1, 2, 4, ... options.samples fresh samples, of which the time counts from the last
// turn on. invalid_argument: a step that camera_paths.h has not.
Result<StudyReport> run_turn_study(BenchContext& context);

}  // namespace helio::bench
