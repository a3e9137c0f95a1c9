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
  }
  return "unknown";
}

Result<Integrator> parse_integrator(const std::string& name) {
  for (const Integrator integrator : kEveryIntegrator) {
    if (name == to_string(integrator)) return integrator;
  }
  return Error{ErrorCode::invalid_argument,
               "\"" + name + "\" is not an integrator; allowed: path, light, bdpt, pt-bdpt", "integrator"};
}

}  // namespace helio
