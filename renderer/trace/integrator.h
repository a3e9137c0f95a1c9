// By which techniques light is carried from lights to the camera.
#pragma once

#include <cstdint>

namespace helio {

enum class Integrator : std::uint8_t {
  path,   // path tracing with next-event estimation
  light,  // light paths joined to the camera (t = 1), and lights that it sees directly: nothing that mirrors show
  bdpt,   // camera paths and light paths, joined at every pair of vertices
};

}  // namespace helio
