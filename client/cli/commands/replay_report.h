// A replayed sample as lines to read.
#pragma once

#include <string>

#include "heliograph/v1/replay.pb.h"

namespace helio::cli {

// "pixel 12,34, half 0, sample 17".
std::string describe_id(const heliograph::v1::SampleId& id);

// "pixel 12,34, half 0, sample 17 of a 640x360 film, seed 0: ...", and what it amounts to.
std::string describe_sample(const heliograph::v1::ReplaySampleResponse& replay);

// A vertex of the light path. `first_not_finite` as below.
std::string describe_light_vertex(const heliograph::v1::TracedLightVertex& vertex, const std::string& first_not_finite);

// One vertex, several lines. `first_not_finite`: what to point at, empty for nothing.
std::string describe_vertex(const heliograph::v1::TracedVertex& vertex, const std::string& first_not_finite);

}  // namespace helio::cli
