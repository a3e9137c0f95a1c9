// Whether a host, as users write it, is this machine itself.
#pragma once

#include <arpa/inet.h>

#include <string>

namespace helio {

// `host` without port or brackets. The name localhost and literal addresses only, no name is looked up: 127.0.0.0/8,
// ::1, and the former mapped into IPv6.
inline bool is_loopback_host(const std::string& host) {
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6{};
  if (inet_pton(AF_INET6, host.c_str(), &v6) != 1) return false;
  return IN6_IS_ADDR_LOOPBACK(&v6) || (IN6_IS_ADDR_V4MAPPED(&v6) && v6.s6_addr[12] == 127);
}

}  // namespace helio
