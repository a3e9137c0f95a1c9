// One mode against the first, in at most three sentences.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "renderer/comparison/findings.h"

namespace helio {

// Told of `key`: at equal error and time, at equal samples and in speed; then which other measures are decided. One
// sentence where nothing is decided, and where the baseline's pictures are previews. Preconditions: mode > 0, which is
// no preview mode and has points.
std::vector<std::string> mode_sentences(const Findings& findings, std::size_t mode, const ValueKey& key);

// Tells the time and error of the previews of a preview mode, which may be the baseline, at that budget, and the
// baseline's error after the same time where its curve encloses it. Empty without seeds.
std::string preview_sentence(const Findings& findings, std::size_t mode, const ValueKey& key, std::uint32_t budget);

}  // namespace helio
