#include "client/tev/tev_address.h"

#include <netdb.h>
#include <sys/un.h>

#include <cstddef>
#include <cstring>
#include <memory>

#include "client/server_address.h"

namespace helio {

namespace {

constexpr std::size_t kMostPathBytes = sizeof(sockaddr_un::sun_path) - 1;

Error malformed(const std::string& text) {
  return {ErrorCode::invalid_argument,
          "'" + text + "' is not HOST:PORT with a port in [1, 65535], such as " + kDefaultTevAddress +
              ", [IPV6]:PORT, or unix:PATH with a path of at most " + std::to_string(kMostPathBytes) + " bytes",
          "tev"};
}

}  // namespace

Result<TevAddress> resolve_tev_address(const std::string& text) {
  if (!validate_server_address(text)) return malformed(text);
  TevAddress address;
  address.text = text;
  if (text.rfind("unix:", 0) == 0) {
    const std::string path = text.substr(5);
    if (path.size() > kMostPathBytes) return malformed(text);
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::memcpy(name.sun_path, path.data(), path.size());
    TevAddress::Endpoint& endpoint = address.endpoints.emplace_back();
    endpoint.size = socklen_t(offsetof(sockaddr_un, sun_path) + path.size() + 1);
    std::memcpy(&endpoint.bytes, &name, endpoint.size);
    return address;
  }
  const std::size_t colon = text.rfind(':');
  std::string host = text.substr(0, colon);
  if (host.front() == '[') host = host.substr(1, host.size() - 2);
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  // Loopback needs no name service, and machines without /etc/hosts have none that knows it.
  const char* const name = host == "localhost" ? nullptr : host.c_str();
  const int problem = getaddrinfo(name, text.substr(colon + 1).c_str(), &wanted, &found);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, freeaddrinfo);
  if (problem != 0) {
    return Error{ErrorCode::not_found, "the host of '" + text + "' cannot be found: " + gai_strerror(problem), "tev"};
  }
  for (const addrinfo* entry = found; entry; entry = entry->ai_next) {
    TevAddress::Endpoint& endpoint = address.endpoints.emplace_back();
    endpoint.size = entry->ai_addrlen;
    std::memcpy(&endpoint.bytes, entry->ai_addr, entry->ai_addrlen);
  }
  return address;
}

}  // namespace helio
