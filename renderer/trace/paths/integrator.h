// Which paths make a picture.
#pragma once

#include <cstdint>

namespace helio {

enum class Integrator : std::uint8_t {
  path,     // from the camera, with next-event estimation
  light,    // from the lights, each vertex connected to the camera (t = 1), and what the camera sees of lights and the
            // environment directly: nothing that mirrors and glass show
  bdpt,     // from both, all connections (s, t)
  pt_bdpt,  // path or bdpt, tile by tile, whichever pays (pilot_render.h)
  lvc,      // as bdpt, camera vertices joined to a few light vertices of the whole picture's (light_vertex_cache.h)
  vcm,      // lvc, and light paths that arrive near a camera vertex merged with it: biased, less and less so
  photon,   // merging alone, at every vertex up to the first scattering that is no delta: progressive photon mapping
};
inline constexpr Integrator kEveryIntegrator[] = {Integrator::path,    Integrator::light, Integrator::bdpt,
                                                  Integrator::pt_bdpt, Integrator::lvc,   Integrator::vcm,
                                                  Integrator::photon};

// True when light paths are traced. Except for those of photon, which are merged alone, they also splat to any pixel,
// so that the film needs splats (film/splats/splat_buffer.h).
constexpr bool traces_light_paths(Integrator integrator) {
  return integrator != Integrator::path;
}
// Camera paths draw on a LightVertexCache of their pass.
constexpr bool caches_light_vertices(Integrator integrator) {
  return integrator == Integrator::lvc || integrator == Integrator::vcm || integrator == Integrator::photon;
}
constexpr bool merges(Integrator integrator) {
  return integrator == Integrator::vcm || integrator == Integrator::photon;
}
const char* to_string(Integrator integrator);

}  // namespace helio
