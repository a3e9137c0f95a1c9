// Limits of a comparison's answers: bias, rare errors, the reference's noise, few seeds, disturbances.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/comparison/findings.h"

namespace helio {

// At most eight sentences about errors that a few pixels decide (one a mode, or one of all modes where there are more),
// and one sentence of each other kind. last: the last budget that has seeds.
std::vector<std::string> limit_sentences(const Findings& findings, std::uint32_t last);

}  // namespace helio
