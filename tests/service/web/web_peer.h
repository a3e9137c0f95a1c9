// The other end of a web server's connection: bytes as they are, so that a test can send what no browser would.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

struct ssl_st;

namespace helio::test {

struct HttpAnswer {
  int status = 0;                              // 0: the connection ended without one
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
};

struct WebFrame {
  int opcode = 0;  // RFC 6455, section 5.2: 1 text, 2 binary, 8 close, 9 ping, 10 pong
  std::string payload;

  int close_code() const;  // 0: none
  std::string close_reason() const;
};

// What a browser that speaks TLS has. PEM; of the last two empty: it shows no certificate.
struct WebTrust {
  std::string ca;  // of whom it trusts
  std::string certificate, key;
};

class WebPeer {
 public:
  explicit WebPeer(const std::string& address);  // HOST:PORT of 127.0.0.1
  // By TLS. Where the handshake fails, everything else does.
  WebPeer(const std::string& address, const WebTrust& trust);
  ~WebPeer();
  WebPeer(const WebPeer&) = delete;
  WebPeer& operator=(const WebPeer&) = delete;

  bool send(const std::string& bytes);
  void set_patience(int seconds);  // of send(), which is else endless
  static std::string frame(int opcode, const std::string& payload, bool masked = true);
  // One answer, its body by Content-Length; `head`: none follows.
  HttpAnswer read_answer(bool head = false);
  // The same of "METHOD PATH" with these headers beside Host: 127.0.0.1.
  HttpAnswer get(const std::string& path, const std::map<std::string, std::string>& headers = {},
                 const std::string& method = "GET");

  // The handshake of a page of 127.0.0.1; `headers` replace its own, or take one out where empty. Status 101: open.
  HttpAnswer upgrade(const std::map<std::string, std::string>& headers = {});
  bool send_frame(int opcode, const std::string& payload, bool masked = true);
  bool send_message(const std::string& payload) { return send_frame(2, payload); }
  // The next data or close frame; pings are answered. Nothing: the connection has ended.
  std::optional<WebFrame> read_frame();
  bool ended();  // waits for the end of the connection, at most a minute

 private:
  bool read_exactly(std::size_t bytes, std::string& out);
  bool fill();

  int socket_ = -1;
  std::shared_ptr<ssl_st> tls_;  // null: without
  std::string buffered_;
};

}  // namespace helio::test
