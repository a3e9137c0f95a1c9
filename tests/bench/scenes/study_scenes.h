// The scenes that several benches measure when none is named.
#pragma once

#include <string>
#include <vector>

namespace helio::bench {

// Those of Schalk's study (2018, chapter 4) by light, size and material, and scenes of other kinds beside them.
const std::vector<std::string>& study_scenes();

// For comparisons of modes: those of the study, then five whose light is hard to find.
const std::vector<std::string>& default_mode_scenes();

}  // namespace helio::bench
