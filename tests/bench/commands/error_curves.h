// Measures error curves: several ways to make the same picture, in turns.
#pragma once

#include <functional>

#include "tests/bench/reports/error_report.h"
#include "tests/bench/scenes/error_scenes.h"

namespace helio::bench {

// One way to make the picture.
struct Contender {
  std::string renderer, mode;
  std::function<Result<LoopPicture>(int samples, std::uint64_t seed)> render;
};

// 1, 2, 4, ... up to `most`, which is the last one even where it is no power of two.
std::vector<int> doubling_counts(int most);

// Of a picture that took so long. The views have the same size.
Result<PictureError> picture_error(const PictureView& picture, double seconds, const LoopPicture& reference);

// A picture of each count of each seed of each contender, each from nothing, so that its time is what a caller who asks
// for so many samples waits; the contenders take turns. One round before the first seed is thrown away.
Result<std::vector<CurveReport>> measure_curves(const ErrorScene& scene, const std::vector<Contender>& contenders,
                                                const std::vector<int>& counts, int seeds);

// Prints the report (`as_json`: JSON, else a table) and writes curves.json, curves.csv and curves.svg into `folder`,
// which is made; empty: nothing is written.
Status publish_curves(const std::vector<CurveReport>& curves, bool as_json, const std::string& folder);

}  // namespace helio::bench
