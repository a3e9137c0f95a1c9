// The address that a daemon serves on, as --listen gives it.
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

struct ListenAddress {
  std::string host;  // without brackets
  int port = 0;      // 0: any free one
  bool loopback = false;
};

// The host as it stands before a port: an IPv6 address in brackets.
std::string bracketed(const std::string& host);

// HOST:PORT; an IPv6 address in brackets. invalid_argument, `where` "listen".
Result<ListenAddress> parse_listen_address(const std::string& text);

}  // namespace helio
