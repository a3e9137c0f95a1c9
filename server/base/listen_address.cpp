#include "server/base/listen_address.h"

#include <algorithm>

#include "renderer/base/loopback.h"

namespace helio {

std::string bracketed(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

Result<ListenAddress> parse_listen_address(const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  ListenAddress address;
  if (colon != std::string::npos) address.host = listen.substr(0, colon);
  const std::string port = colon == std::string::npos ? "" : listen.substr(colon + 1);
  if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  } else if (address.host.find(':') != std::string::npos) {
    address.host.clear();  // an IPv6 address needs its brackets
  }
  const bool digits = !port.empty() && port.size() <= 5 &&
                      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (address.host.empty() || !digits || std::stoi(port) > 65535) {
    return Error{ErrorCode::invalid_argument, "'" + listen + "'; allowed: HOST:PORT, PORT from 0 (any free) to 65535",
                 "listen"};
  }
  address.port = std::stoi(port);
  address.loopback = is_loopback_host(address.host);
  return address;
}

}  // namespace helio
