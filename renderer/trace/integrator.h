// Which paths make a picture.
#pragma once

#include <cstdint>
#include <string>

#include "renderer/base/result.h"

namespace helio {

enum class Integrator : std::uint8_t {
  path,   // from the camera, with next-event estimation
  light,  // from the lights, each vertex connected to the camera (t = 1), and what the camera sees of lights and the
          // environment directly: nothing that mirrors and glass show
  bdpt,   // from both, all connections (s, t)
  path_bdpt,  // path or bdpt, tile by tile, whichever pays (technique_probe.h)
};
inline constexpr Integrator kEveryIntegrator[] = {Integrator::path, Integrator::light, Integrator::bdpt,
                                                  Integrator::path_bdpt};

// Light paths reach the camera at any pixel: the film has splats (film/splat_buffer.h).
constexpr bool traces_light_paths(Integrator integrator) {
  return integrator != Integrator::path;
}
const char* to_string(Integrator integrator);
// invalid_argument, naming "integrator", the value and those allowed.
Result<Integrator> parse_integrator(const std::string& name);

}  // namespace helio
