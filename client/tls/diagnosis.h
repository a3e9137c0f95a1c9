// Why no connection came about: gRPC tells that one failed, and rarely what to do about it.
#pragma once

#include <string>

#include "client/tls/tls_options.h"

namespace helio {

// Connects once more by itself, to HOST:PORT, and looks: does the daemon speak TLS, whose is its certificate, does it
// ask for one. A clause for people that says what to give ("it speaks TLS: ..."); empty: TLS does not explain it, or
// nobody answers there. Takes a few seconds at most.
std::string diagnose_tls(const std::string& address, const TlsOptions& options);

}  // namespace helio
