// The torture set: scenes thrown together at random from what is allowed but extreme.
#pragma once

#include <cmath>
#include <cstdint>

#include "renderer/scene/description/scene_description.h"
#include "renderer/trace/camera/camera.h"
#include "tests/support/random.h"

namespace helio::test {

// Numbers in the places where formulas change their course.
class Extremes {
 public:
  explicit Extremes(std::uint64_t seed) : random_(seed) {}

  float uniform(float low = 0, float high = 1) { return low + (high - low) * random_.next_float(); }
  bool chance(float p) { return random_.next_float() < p; }
  int below(int n) { return std::min(n - 1, int(random_.next_float() * float(n))); }

  // In [0, 1], the ends and their neighbourhoods often.
  float unit();
  float log_uniform(float low, float high) { return low * std::pow(high / low, uniform()); }
  Rgb color() { return {unit(), unit(), unit()}; }
  V3f direction();

 private:
  Random random_;
};

// A room or none, a handful of objects, lights near and far; `scale`: its size, within that.
SceneDescription torture_scene(Extremes& x, float scale);
CameraPose torture_camera(Extremes& x, float scale);

}  // namespace helio::test
