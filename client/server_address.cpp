#include "client/server_address.h"

#include <charconv>

#include "renderer/base/loopback.h"

namespace helio {

namespace {

bool starts_with(const std::string& text, const char* start) {
  return text.rfind(start, 0) == 0;
}

bool is_port(const std::string& text) {
  int port = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), port);
  return problem == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

}  // namespace

Status validate_server_address(const std::string& address) {
  if (starts_with(address, "unix:") && address.size() > 5) return ok_status();
  const std::size_t colon = address.rfind(':');
  const std::string host = colon == std::string::npos ? address : address.substr(0, colon);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  const bool plain = !host.empty() && host.find_first_of(":[]/ \t") == std::string::npos;
  if (colon != std::string::npos && (bracketed || plain) && is_port(address.substr(colon + 1))) return ok_status();
  return Error{ErrorCode::invalid_argument,
               "'" + address + "' is not HOST:PORT with a port in [1, 65535], such as 127.0.0.1:7777, or unix:PATH",
               "server"};
}

bool is_loopback(const std::string& address) {
  if (starts_with(address, "unix:")) return true;
  std::string host = address.substr(0, address.rfind(':'));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return is_loopback_host(host);
}

}  // namespace helio
