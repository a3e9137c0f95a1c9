#include "web/web_peer.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace helio::test {
namespace {

constexpr int kPatienceMs = 60000;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

int WebFrame::close_code() const {
  return payload.size() < 2 ? 0 : std::uint8_t(payload[0]) << 8 | std::uint8_t(payload[1]);
}

std::string WebFrame::close_reason() const {
  return payload.size() < 2 ? std::string() : payload.substr(2);
}

WebPeer::WebPeer(const std::string& address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(std::uint16_t(std::stoi(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socket_ = socket(AF_INET, SOCK_STREAM, 0);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    close(socket_);
    socket_ = -1;
  }
}

WebPeer::WebPeer(const std::string& address, const WebTrust& trust) : WebPeer(address) {
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  const auto reader = [](const std::string& text) {
    return std::unique_ptr<BIO, int (*)(BIO*)>(BIO_new_mem_buf(text.data(), int(text.size())), BIO_free);
  };
  const std::unique_ptr<X509, void (*)(X509*)> ca(PEM_read_bio_X509(reader(trust.ca).get(), nullptr, nullptr, nullptr),
                                                  X509_free);
  X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), ca.get());
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  if (!trust.certificate.empty()) {
    const std::unique_ptr<X509, void (*)(X509*)> own(
        PEM_read_bio_X509(reader(trust.certificate).get(), nullptr, nullptr, nullptr), X509_free);
    const std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)> key(
        PEM_read_bio_PrivateKey(reader(trust.key).get(), nullptr, nullptr, nullptr), EVP_PKEY_free);
    SSL_CTX_use_certificate(context.get(), own.get());
    SSL_CTX_use_PrivateKey(context.get(), key.get());
  }
  tls_.reset(SSL_new(context.get()), SSL_free);
  SSL_set_fd(tls_.get(), socket_);
  if (SSL_connect(tls_.get()) == 1) return;
  tls_.reset();
  close(std::exchange(socket_, -1));
}

WebPeer::~WebPeer() {
  if (socket_ >= 0) close(socket_);
}

bool WebPeer::send(const std::string& bytes) {
  std::size_t sent = 0;
  while (socket_ >= 0 && sent < bytes.size()) {
    const ssize_t n = tls_ ? SSL_write(tls_.get(), bytes.data() + sent, int(bytes.size() - sent))
                           : ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += std::size_t(n);
  }
  return socket_ >= 0;
}

bool WebPeer::fill() {
  pollfd readable{socket_, POLLIN, 0};
  const bool waits = !tls_ || SSL_pending(tls_.get()) == 0;
  if (socket_ < 0 || (waits && poll(&readable, 1, kPatienceMs) != 1)) return false;
  char bytes[65536];
  const ssize_t n = tls_ ? SSL_read(tls_.get(), bytes, sizeof bytes) : recv(socket_, bytes, sizeof bytes, 0);
  if (n <= 0) return false;
  buffered_.append(bytes, std::size_t(n));
  return true;
}

bool WebPeer::read_exactly(std::size_t bytes, std::string& out) {
  while (buffered_.size() < bytes) {
    if (!fill()) return false;
  }
  out = buffered_.substr(0, bytes);
  buffered_.erase(0, bytes);
  return true;
}

HttpAnswer WebPeer::read_answer(bool head) {
  HttpAnswer answer;
  std::size_t end = 0;
  while ((end = buffered_.find("\r\n\r\n")) == std::string::npos) {
    if (!fill()) return answer;
  }
  const std::string text = buffered_.substr(0, end + 2);
  buffered_.erase(0, end + 4);
  for (std::size_t line = text.find("\r\n") + 2; line < text.size();) {
    const std::size_t next = text.find("\r\n", line), colon = text.find(": ", line);
    answer.headers[lower(text.substr(line, colon - line))] = text.substr(colon + 2, next - colon - 2);
    line = next + 2;
  }
  const auto length = answer.headers.find("content-length");
  if (length != answer.headers.end() && !head && !read_exactly(std::stoul(length->second), answer.body)) return answer;
  answer.status = std::stoi(text.substr(9, 3));
  return answer;
}

HttpAnswer WebPeer::get(const std::string& path, const std::map<std::string, std::string>& headers,
                        const std::string& method) {
  std::map<std::string, std::string> all{{"Host", "127.0.0.1"}};
  for (const auto& [name, value] : headers) all[name] = value;
  std::string request = method + " " + path + " HTTP/1.1\r\n";
  for (const auto& [name, value] : all) {
    if (!value.empty()) request += name + ": " + value + "\r\n";
  }
  send(request + "\r\n");
  return read_answer(method == "HEAD");
}

HttpAnswer WebPeer::upgrade(const std::map<std::string, std::string>& headers) {
  std::map<std::string, std::string> all{{"Connection", "Upgrade"},
                                         {"Upgrade", "websocket"},
                                         {"Sec-WebSocket-Version", "13"},
                                         {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="},
                                         {"Sec-WebSocket-Protocol", "heliograph.v1"},
                                         {"Origin", "http://127.0.0.1"}};
  for (const auto& [name, value] : headers) all[name] = value;
  return get("/ws", all);
}

bool WebPeer::send_frame(int opcode, const std::string& payload, bool masked) {
  return send(frame(opcode, payload, masked));
}

void WebPeer::set_patience(int seconds) {
  const timeval time{seconds, 0};
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &time, sizeof time);
}

std::string WebPeer::frame(int opcode, const std::string& payload, bool masked) {
  constexpr char kMask[4] = {0x12, 0x34, 0x56, 0x78};
  const char mask_bit = masked ? char(0x80) : char(0);
  std::string frame{char(0x80 | opcode)};
  if (payload.size() < 126) {
    frame += char(mask_bit | char(payload.size()));
  } else {
    const bool wide = payload.size() > 0xffff;
    frame += char(mask_bit | char(wide ? 127 : 126));
    for (int byte = wide ? 7 : 1; byte >= 0; --byte) frame += char(payload.size() >> (8 * byte));
  }
  if (masked) frame.append(kMask, 4);
  for (std::size_t i = 0; i < payload.size(); ++i) frame += masked ? char(payload[i] ^ kMask[i % 4]) : payload[i];
  return frame;
}

std::optional<WebFrame> WebPeer::read_frame() {
  for (;;) {
    std::string head, bytes;
    if (!read_exactly(2, head)) return std::nullopt;
    std::uint64_t length = std::uint8_t(head[1]) & 0x7f;
    if (length >= 126) {
      if (!read_exactly(length == 126 ? 2 : 8, bytes)) return std::nullopt;
      length = 0;
      for (const char byte : bytes) length = length << 8 | std::uint8_t(byte);
    }
    WebFrame frame;
    frame.opcode = head[0] & 0xf;
    if (!read_exactly(std::size_t(length), frame.payload)) return std::nullopt;
    if (frame.opcode == 9) {
      send_frame(10, frame.payload);
    } else if (frame.opcode != 10) {
      return frame;
    }
  }
}

bool WebPeer::ended() {
  if (socket_ < 0) return true;
  for (;;) {
    pollfd readable{socket_, POLLIN, 0};
    if (poll(&readable, 1, kPatienceMs) != 1) return false;
    char bytes[4096];
    if (recv(socket_, bytes, sizeof bytes, 0) <= 0) return true;
  }
}

}  // namespace helio::test
