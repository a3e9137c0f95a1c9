#include "renderer/trace/integrator.h"

namespace helio {

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::path:
      return "path";
    case Integrator::light:
      return "light";
    case Integrator::bdpt:
      return "bdpt";
    case Integrator::path_bdpt:
      return "pt-bdpt";
    case Integrator::lvc:
      return "lvc";
    case Integrator::vcm:
      return "vcm";
    case Integrator::photon:
      return "photon";
  }
  return "unknown";
}

Result<Integrator> parse_integrator(const std::string& name) {
  std::string allowed;
  for (const Integrator integrator : kEveryIntegrator) {
    if (name == to_string(integrator)) return integrator;
    allowed += (allowed.empty() ? "" : ", ") + std::string(to_string(integrator));
  }
  return Error{ErrorCode::invalid_argument, "\"" + name + "\" is not an integrator; allowed: " + allowed, "integrator"};
}

}  // namespace helio
