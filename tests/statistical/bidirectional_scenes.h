// Scenes on which the integrators must agree: each holds something that a light path has to get right on its own.
#pragma once

#include <ostream>
#include <span>

#include "tests/support/test_scenes.h"

namespace helio::test {

struct BidirectionalScene {
  SceneDescription description;
  CameraPose pose;
  PixelFilter filter;
  int max_segments = 6;
  // Light paths that are joined to the camera find all that it sees: see bidirectional_test.cpp.
  bool light_sees_all = false;
  std::uint32_t samples = 16;    // of a half, in a batch
  int seeds = 16;                // two batches each, one a half
  double largest_error = 0.001;  // standard error of the difference of means, relative: what the batches must reach
};

struct NamedBidirectionalScene {
  const char* name;
  BidirectionalScene (*make)();
  bool in_short_tier = false;  // one scene for each class of light transport
};

std::span<const NamedBidirectionalScene> bidirectional_scenes();

// Two rooms before one camera: of the left one a screen is seen that glitters, the right one, a part of the picture, is
// lit by a lamp that is covered from below. Light paths pay in that part alone.
BidirectionalScene half_covered();

void PrintTo(const NamedBidirectionalScene& scene, std::ostream* out);

}  // namespace helio::test
