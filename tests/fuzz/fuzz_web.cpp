// What may come on a connection to the page's server. The first byte chooses: 0 bytes of HTTP; 1 bytes behind the
// handshake of a WebSocket; 2 the same behind hello, as the content of binary messages, each as long as its first byte
// says.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include "heliograph/v1/web.pb.h"
#include "server/app/server.h"

namespace {

using namespace helio;

void demand(bool condition) {
  if (!condition) std::abort();
}

// One daemon for all inputs: what one leaves behind the next ones meet.
int http_port() {
  static const std::unique_ptr<Server> server = [] {
    spdlog::set_level(spdlog::level::off);
    ServerConfig config;
    config.listen.clear();
    config.http = "127.0.0.1:0";
    config.render_threads = 1;
    config.max_memory = 64 << 20;
    auto started = Server::start(config);
    demand(started.ok());
    return std::move(*started);
  }();
  return std::stoi(server->http_address().substr(server->http_address().rfind(':') + 1));
}

std::string frame(const std::string& payload) {
  demand(payload.size() < 256);
  std::string bytes{char(0x82)};
  if (payload.size() < 126) {
    bytes += char(0x80 | payload.size());
  } else {
    bytes += {char(0xfe), 0, char(payload.size())};
  }
  return bytes + std::string(4, '\0') + payload;  // a mask of zeros
}

const std::string kUpgrade =
    "GET /ws HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    "Sec-WebSocket-Protocol: heliograph.v1\r\n\r\n";

// Sends and reads until the server ends the connection, as it must once nothing more comes.
std::string exchange(const std::string& bytes) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(std::uint16_t(http_port()));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int peer = socket(AF_INET, SOCK_STREAM, 0);
  demand(peer >= 0 && connect(peer, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  const int on = 1;
  setsockopt(peer, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  (void)!send(peer, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  shutdown(peer, SHUT_WR);
  std::string answer;
  char piece[4096];
  for (ssize_t n; (n = recv(peer, piece, sizeof piece, 0)) > 0;) answer.append(piece, std::size_t(n));
  const linger reset{1, 0};  // leaves no port behind that waits for minutes
  setsockopt(peer, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
  close(peer);
  return answer;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::string sent;
  switch (data[0]) {
    case 0:
      sent = bytes;
      break;
    case 1:
      sent = kUpgrade + bytes;
      break;
    case 2: {
      heliograph::v1::WebRequest hello;
      hello.mutable_hello()->set_envelope(1);
      sent = kUpgrade + frame(hello.SerializeAsString());
      for (std::size_t at = 0; at < bytes.size();) {
        const std::string message = bytes.substr(at + 1, std::uint8_t(bytes[at]));
        sent += frame(message);
        at += 1 + message.size();
      }
      break;
    }
    default:
      return 0;
  }
  const std::string answer = exchange(sent);
  demand(answer.empty() || answer.starts_with("HTTP/1."));
  // Empty: the server closed while bytes were still coming, and the kernel dropped its answer with them.
  if (data[0] != 0) demand(answer.empty() || answer.starts_with("HTTP/1.1 101 "));
  static std::uint64_t inputs = 0;
  if (++inputs % 64 == 0) {
    demand(exchange("GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n").starts_with("HTTP/1.1 200 "));
  }
  return 0;
}
