// heliographd --http: the viewer's page and its WebSocket, on one thread that takes no render core's work.
#pragma once

#include <grpcpp/channel.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "server/base/access_control.h"
#include "server/base/tls_certificates.h"

namespace helio {

class WebServer {
 public:
  struct Options {
    std::string listen;              // HOST:PORT, port 0: any free one
    std::vector<std::string> hosts;  // names that browsers may call it by, beside those of loopback
    int max_connections = 64;        // [1, 65536]
    const AccessControl* tokens = nullptr;                    // outlives the server; null: everyone may
    std::shared_ptr<TlsCertificates> certificates = nullptr;  // null: the page is served without TLS
    // For each request from its first byte to its last, its answer, the time between two, and a WebSocket's hello.
    double patience_s = 15;
  };
  // Browsers wait until serve(). Errors: invalid_argument (address, or one that others reach without tokens and without
  // certificates of callers), unavailable (in use). `where` is "http".
  static Result<std::unique_ptr<WebServer>> listen(const Options& options);
  // `channel`: to the service, in process. `ready`: whether new work is taken; called on the server's thread. Once.
  void serve(std::shared_ptr<grpc::Channel> channel, std::function<bool()> ready);
  // Ends all connections. Returns once their calls are over.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  const std::string& address() const;  // "127.0.0.1:40123"

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
