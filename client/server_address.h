// What a server may be called on a command line.
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

// HOST:PORT (host name, IPv4 address or [IPv6], port in [1, 65535]) or unix:PATH. invalid_argument otherwise.
Status validate_server_address(const std::string& address);

// True when the traffic stays on this machine as far as the address tells: localhost, 127.*, [::1], unix:.
bool is_loopback(const std::string& address);

}  // namespace helio
