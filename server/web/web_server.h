// heliographd --http: the viewer's page and its WebSocket, on one thread that takes no render core's work.
#pragma once

#include <grpcpp/channel.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "server/base/access_control.h"
#include "server/web/tls_certificates.h"

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
  // What the rest of the daemon answers.
  struct Sources {
    // Why no new work is taken, as a sentence; empty: it is. Called on the server's thread; null: it is.
    std::function<std::string()> unready = {};
    // Has the text of /metrics made, on a thread that may wait, and handed to `told` there. False: too many wait for it
    // already. An empty text: there is none yet. Null: there never is.
    std::function<bool(std::function<void(std::string text)> told)> metrics = {};
  };
  // Browsers wait until serve(). Errors: invalid_argument (address, or one that others reach without tokens and without
  // certificates of callers), unavailable (in use). `where` is "http".
  static Result<std::unique_ptr<WebServer>> listen(const Options& options);
  // Files, health and metrics from now on. Once.
  void serve(Sources sources);
  // WebSockets, too. `channel`: to the service, in process. After serve(), once.
  void open(std::shared_ptr<grpc::Channel> channel);
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
