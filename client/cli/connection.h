// Where the rendering happens: a daemon named by --server, or this very process.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/render_client.h"

namespace helio {
class Server;
}

namespace helio::cli {

struct ConnectionOptions {
  TextOption server, wait, token_file, threads, isa;
  bool tls = false, no_tls = false;
  TextOption tls_ca, tls_certificate, tls_key, tls_name;
  bool needs_daemon = false;  // nothing is rendered in process
};
void add_connection_options(CLI::App& app, ConnectionOptions& options);
// Adds the options of a command that needs a daemon: --server, else the variable HELIOGRAPH_SERVER, must name it.
void add_daemon_options(CLI::App& app, ConnectionOptions& options);

struct Connection {
  std::string address;  // empty: in process
  // " --server ADDRESS" and what else was given of how the daemon is reached, for a command that is to be pasted.
  std::string flags;
  ConnectOptions connect;
  int threads = 0;           // in process: render threads, 0: one per core
  std::string isa;           // in process: instruction set of Embree; empty: automatic
  std::string oidn_library;  // in process: of Open Image Denoise; empty: none
  // In process: the viewer's page, HOST:PORT; empty: none. Who wants it names connect.token.
  std::string http;
  std::vector<std::string> scene_roots;  // in process
  bool allow_exclusive = false;          // in process: comparisons may keep everything else waiting
  bool vulkan_devices = false;           // in process: Vulkan devices are looked for and may be used
};
Connection read_connection(const ConnectionOptions& options, OptionReader& reader);

// A client and, in process, the server behind it.
class Renderer {
 public:
  static Result<Renderer> open(const Connection& connection);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  RenderClient& client() { return *client_; }
  bool in_process() const { return server_ != nullptr; }
  const std::string& http_address() const;  // in process: of the viewer's page; empty: there is none

 private:
  Renderer();

  std::unique_ptr<Server> server_;  // outlives the client
  std::unique_ptr<RenderClient> client_;
};

}  // namespace helio::cli
