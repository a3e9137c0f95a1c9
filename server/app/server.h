// The daemon as a value: engine, registries and gRPC server, usable in process as well.
#pragma once

#include <grpcpp/channel.h>

#include <cstdint>
#include <memory>
#include <string>

#include "renderer/base/result.h"
#include "server/base/server_config.h"

namespace helio {

class Server {
 public:
  // Starts serving. With config.listen empty only in_process_channel() reaches it.
  // Errors: invalid_argument (scene root, address, isa, oidn-library, http, token-file, files of TLS, an address that
  // other machines reach without TLS), unavailable (address in use), failed_precondition (isa, when this process traces
  // with another already).
  static Result<std::unique_ptr<Server>> start(const ServerConfig& config);
  // Ends everything at once (a drain without grace).
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // "127.0.0.1:40123" as bound; empty when in-process only.
  const std::string& address() const;
  // The same of the viewer's page; empty: there is none.
  const std::string& http_address() const;
  // Whether both are served by TLS.
  bool tls() const;
  // Reads the token file and the files of TLS again. What is wrong in them is told in the log, and what was before
  // stays in force. Calls whose token is gone end with UNAUTHENTICATED.
  void reload();
  // The same service without a socket. Valid as long as the server lives.
  std::shared_ptr<grpc::Channel> in_process_channel();

  // Bytes of the memory account (max_memory) that are in use now.
  std::uint64_t memory_used() const;

  // Health turns NOT_SERVING at once, new work is refused with UNAVAILABLE, interactive frames end, jobs may finish
  // until the grace is over and are cancelled then. Returns when no call is left, at the latest soon after the grace.
  // Idempotent. False: something is left that the destructor will wait for, seconds at most: a scene load or an edit, or a
  // connection whose peer takes no bytes.
  bool drain(double grace_s);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
