// The health service of a daemon (grpc.health.v1.Health), which answers without a token, and while the daemon drains.
#pragma once

#include <string>

#include "client/service_link.h"
#include "renderer/base/result.h"

namespace helio {

// Whether the daemon takes new work: it does not while it drains, or before it is ready. `service`: one that it serves,
// such as "heliograph.v1.RenderService"; empty: the daemon as a whole. Errors: not_found (it serves no such service),
// unavailable.
Result<bool> is_serving(const ServiceLink& link, const std::string& service);

}  // namespace helio
