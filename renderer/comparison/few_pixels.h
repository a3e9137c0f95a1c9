// Whether a few pixels decide what a mode's seeds came to.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "renderer/comparison/seed_values.h"

namespace helio {

// heavy_tails.h for the value keys[key] of these seeds, those without it left out; of squared errors by the shares of
// their outliers, where all these seeds have them. Never of outlier_share: shares of the error say how it is spread,
// and that rare pixels have much of it is no finding about the share itself.
bool few_pixels_decide(std::span<const SeedValues* const> seeds, const std::vector<ValueKey>& keys, std::size_t key);

}  // namespace helio
