// Several ways to make the same picture, in turns.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/bench/reports/comparison_record.h"

namespace helio::bench {

struct Contender {
  RecordedMode mode;
  std::function<Result<LoopPicture>(int samples, std::uint64_t seed)> render;
};

// 1, 2, 4, ... up to `most`, which is the last one even where it is no power of two.
std::vector<int> doubling_counts(int most);

// A picture of each count of each seed of each contender, each from nothing, so that its time is what a caller who asks
// for so many samples waits; the contenders take turns. One round before the first seed is thrown away.
Result<pb::CompareRecord> measure_contenders(const ErrorScene& scene, const std::vector<Contender>& contenders,
                                             const std::vector<int>& counts, const BenchOptions& options);

}  // namespace helio::bench
