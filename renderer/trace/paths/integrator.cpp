#include "renderer/trace/paths/integrator.h"

namespace helio {

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::path:
      return "path";
    case Integrator::light:
      return "light";
    case Integrator::bdpt:
      return "bdpt";
    case Integrator::pt_bdpt:
      return "pt+bdpt";
    case Integrator::lvc:
      return "lvc";
    case Integrator::vcm:
      return "vcm";
    case Integrator::photon:
      return "photon";
  }
  return "unknown";
}

}  // namespace helio
