// Scenes whose radiance is known on paper: over the whole picture, for every camera that looks at them.
#pragma once

#include <span>
#include <string>

#include "tests/support/test_scenes.h"

namespace helio::test {

struct ClosedFormScene {
  SceneDescription description;
  V3d radiance;     // of every ray of the views below
  V3d eye, target;  // world coordinates
  double reach;     // half the picture's height at the target: small where the radiance varies over the scene
  int max_segments;
  int samples = 256;  // a pixel of 16x16: enough for a standard error well below 0.5 %
};

struct NamedScene {
  const char* name;
  ClosedFormScene (*make)();
};

// The formula and its source stand beside each in closed_form_scenes.cpp.
std::span<const NamedScene> closed_form_scenes();

void PrintTo(const NamedScene& scene, std::ostream* out);

// Three cameras whose picture reaches equally far at the target. The lens is a third of that wide, focused on the
// target.
enum class CameraKind { perspective, orthographic, thin_lens };
inline constexpr CameraKind kCameraKinds[] = {CameraKind::perspective, CameraKind::orthographic, CameraKind::thin_lens};
const char* to_string(CameraKind kind);
CameraPose pose_of(const ClosedFormScene& scene, CameraKind kind);

}  // namespace helio::test
