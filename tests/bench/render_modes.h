// The modes that benches and tests compare: the one list to which later modes are added.
#pragma once

#include <iterator>

#include "renderer/frame/render_settings.h"

namespace helio::bench {

// A way to render: which samples pixels get, and which paths make them.
struct ComparedMode {
  const char* name;
  RenderMode mode;
  Integrator integrator = Integrator::path;

  void choose_in(RenderSettings& settings) const {
    settings.mode = mode;
    settings.integrator = integrator;
  }
};

// Integrator light is none of them: it leaves out what it cannot show.
inline constexpr ComparedMode kRenderModes[] = {{"pt", RenderMode::pt},
                                                {"adaptive", RenderMode::adaptive},
                                                {"reproject", RenderMode::reproject},
                                                {"combined", RenderMode::combined},
                                                {"bdpt", RenderMode::pt, Integrator::bdpt},
                                                {"pt+bdpt", RenderMode::pt, Integrator::pt_bdpt},
                                                {"lvc", RenderMode::pt, Integrator::lvc},
                                                {"vcm", RenderMode::pt, Integrator::vcm},
                                                {"photon", RenderMode::pt, Integrator::photon}};
static_assert(std::size(kRenderModes) == std::size(kEveryRenderMode) + std::size(kEveryIntegrator) - 2);

}  // namespace helio::bench
