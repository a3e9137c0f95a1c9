// Before the first round of a picture that draws on others: one sample of the first half for each pixel that carries
// nothing, so that every pixel of a tile has something to show as soon as the tile has been reprojected. Which pixels
// have none is all that it looks at; the rounds weigh errors (fill_allocation.h).
#pragma once

#include <cstdint>

#include "renderer/film/core/sample_targets.h"

namespace helio {

// Sets the targets of the window and the levels of its blocks; returns the samples that they ask for. The window is
// aligned to blocks of the film, but at the edges of what is rendered; the film has targets and history, and no fresh
// sample there. Thread safe for disjoint windows.
std::uint64_t target_first_samples(Film& film, const PixelRect& window);

// Sums of that round, which has so many samples in all.
RoundSummary round_of_first_samples(std::uint64_t samples);

}  // namespace helio
