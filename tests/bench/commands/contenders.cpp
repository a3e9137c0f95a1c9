#include "tests/bench/commands/contenders.h"

namespace helio::bench {

std::vector<int> doubling_counts(int most) {
  std::vector<int> counts;
  for (int n = 1; n < most; n *= 2) counts.push_back(n);
  counts.push_back(most);
  return counts;
}

Result<pb::CompareRecord> measure_contenders(const ErrorScene& scene, const std::vector<Contender>& contenders,
                                             const std::vector<int>& counts, const BenchOptions& options) {
  std::vector<RecordedMode> modes;
  for (const Contender& contender : contenders) modes.push_back(contender.mode);
  RecordedComparison comparison(scene.name, scene, modes, counts, options);
  for (int seed = 0; seed <= options.seeds; ++seed) {  // 0: the warm-up
    for (std::size_t k = 0; k < counts.size(); ++k) {
      for (const Contender& contender : contenders) {
        const auto picture = contender.render(counts[k], std::uint64_t(seed));
        if (!picture) return picture.error();
        if (seed == 0) continue;
        const Status added = comparison.add(contender.mode.name, seed, k, picture->view(), picture->seconds);
        if (!added) return added.error();
      }
    }
  }
  return comparison.finish();
}

}  // namespace helio::bench
