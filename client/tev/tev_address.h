// The address at which tev or HDRView listens.
#pragma once

#include <sys/socket.h>

#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

inline constexpr const char* kDefaultTevAddress = "127.0.0.1:14158";  // tev's own default

struct TevAddress {
  struct Endpoint {
    sockaddr_storage bytes{};
    socklen_t size = 0;
  };
  std::string text;                 // as it was given
  std::vector<Endpoint> endpoints;  // tried in this order; at least one
};

// HOST:PORT (host name, IPv4 address or [IPv6], port in [1, 65535]) or unix:PATH of at most 107 bytes. Looks the host
// up, which may take as long as the system's resolver takes. invalid_argument: another form; not_found: no host of that
// name.
Result<TevAddress> resolve_tev_address(const std::string& text);

}  // namespace helio
