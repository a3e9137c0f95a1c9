#include "client/cli/connection.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdlib>

#include "client/cli/shell_word.h"
#include "client/server_address.h"
#include "client/tls/credentials.h"
#include "renderer/base/instruction_set.h"
#include "server/app/server.h"
#include "server/base/access_tokens.h"

namespace helio::cli {

namespace {

void add_address_options(CLI::App& app, ConnectionOptions& options, const std::string& default_server) {
  add_text(app, options.server, "--server", "ADDRESS",
           "Daemon to use: HOST:PORT or unix:PATH. Default: " + default_server);
  add_text(app, options.wait, "--wait", "SECONDS",
           "Keep trying to reach the daemon for so long, (0, 3600]. Default: a refused connection is final");
  add_text(app, options.token_file, "--token-file", "FILE",
           "The daemon's token: the first line of FILE that is neither empty nor begins with #. Only with --server; "
           "default: the variable HELIOGRAPH_TOKEN_FILE, or none");
  add_flag(app, options.tls, "--tls",
           "Encrypt the connection (TLS). So does each of the next four, and the variable HELIOGRAPH_TLS=on");
  add_text(app, options.tls_ca, "--tls-ca", "FILE",
           "Authorities that the daemon's certificate may come from, PEM. Default: the variable HELIOGRAPH_TLS_CA, or "
           "those of the system");
  add_text(app, options.tls_certificate, "--tls-certificate", "FILE",
           "This client's certificate, PEM, for a daemon that asks for one. Default: the variable "
           "HELIOGRAPH_CLIENT_CERTIFICATE, or none");
  add_text(app, options.tls_key, "--tls-key", "FILE",
           "Its key, PEM, without a passphrase. Default: the variable HELIOGRAPH_CLIENT_KEY, or none");
  add_text(
      app, options.tls_name, "--tls-name", "NAME",
      "Name that the daemon's certificate has. Default: the variable HELIOGRAPH_TLS_NAME, or the host of --server");
  add_flag(app, options.no_tls, "--no-tls", "Do not encrypt the connection, whatever those variables say");
}

}  // namespace

void add_connection_options(CLI::App& app, ConnectionOptions& options) {
  add_address_options(app, options, "render in this process");
  add_text(app, options.threads, "--threads", "N",
           "Render threads, [1, 1024]; only without --server. Default: one per core");
  add_text(app, options.isa, "--isa", "NAME",
           "Instruction set that Embree traces with: auto, sse2, sse4.2, avx, avx2, avx512; only without --server. "
           "Default: auto, the newest of this processor");
}

void add_daemon_options(CLI::App& app, ConnectionOptions& options) {
  options.needs_daemon = true;
  add_address_options(app, options, "the variable HELIOGRAPH_SERVER");
}

namespace {

Result<std::string> read_token(const std::string& file) {
  const auto lines = read_token_lines(file);
  if (!lines) return Error{ErrorCode::not_found, "'" + file + "' cannot be read", {}};
  if (lines->empty()) return Error{ErrorCode::invalid_argument, "'" + file + "' holds no token", {}};
  const TokenLine& line = lines->front();
  if (line.text.find_first_of(" \t") == std::string::npos) return line.text;
  return Error{
      ErrorCode::invalid_argument,
      fmt::format("line {} of '{}' holds no token but what a daemon knows of one; allowed: a token", line.number, file),
      {}};
}

// An option's value, or that of a variable; empty: neither is given.
std::string text_or_variable(const TextOption& option, const char* name, OptionReader& reader) {
  const char* variable = std::getenv(name);
  return option.given() ? reader.text(option).value_or("") : variable ? variable : "";
}

TlsOptions read_tls(const ConnectionOptions& options, OptionReader& reader) {
  TlsOptions tls;
  tls.ca_file = text_or_variable(options.tls_ca, "HELIOGRAPH_TLS_CA", reader);
  tls.certificate_file = text_or_variable(options.tls_certificate, "HELIOGRAPH_CLIENT_CERTIFICATE", reader);
  tls.key_file = text_or_variable(options.tls_key, "HELIOGRAPH_CLIENT_KEY", reader);
  tls.name = text_or_variable(options.tls_name, "HELIOGRAPH_TLS_NAME", reader);
  const char* variable = std::getenv("HELIOGRAPH_TLS");
  const std::string wanted = variable ? variable : "";
  if (!wanted.empty() && wanted != "on" && wanted != "off")
    reader.problems().add("--tls", "by HELIOGRAPH_TLS: '" + wanted + "'; allowed: on, off");
  const bool by_file = !tls.ca_file.empty() || !tls.certificate_file.empty() || !tls.key_file.empty();
  tls.on = !options.no_tls && (options.tls || wanted == "on" || by_file || !tls.name.empty());
  const Problems problems = find_tls_problems(tls);
  for (const Problems::Item& item : problems.items()) {
    const TextOption& option = item.where == "ca_file"            ? options.tls_ca
                               : item.where == "certificate_file" ? options.tls_certificate
                                                                  : options.tls_key;
    reader.problem(option, item.message);
  }
  return tls;
}

}  // namespace

namespace {

std::string flags_of(const ConnectionOptions& options, const std::string& address) {
  std::string flags = " --server " + shell_word(address);
  if (options.tls) flags += " --tls";
  if (options.no_tls) flags += " --no-tls";
  const auto add = [&](const char* name, const TextOption& option) {
    if (option.given()) flags += std::string(" ") + name + " " + shell_word(option.text);
  };
  add("--token-file", options.token_file);
  add("--tls-ca", options.tls_ca);
  add("--tls-certificate", options.tls_certificate);
  add("--tls-key", options.tls_key);
  add("--tls-name", options.tls_name);
  return flags;
}

std::optional<std::string> read_address(const ConnectionOptions& options, OptionReader& reader) {
  std::optional<std::string> address = reader.text(options.server);
  const char* variable = options.needs_daemon ? std::getenv("HELIOGRAPH_SERVER") : nullptr;
  const bool by_variable = !options.server.given() && variable && *variable;
  if (by_variable) address = variable;
  if (!address) {
    if (options.needs_daemon && !options.server.given())
      reader.problem(options.server, "is missing: the daemon to ask (or the variable HELIOGRAPH_SERVER)");
    return std::nullopt;
  }
  const Status valid = validate_server_address(*address);
  if (!valid) reader.problem(options.server, (by_variable ? "by HELIOGRAPH_SERVER: " : "") + valid.error().message);
  return address;
}

}  // namespace

Connection read_connection(const ConnectionOptions& options, OptionReader& reader) {
  Connection connection;
  const auto address = read_address(options, reader);
  if (address) {
    connection.address = *address;
    connection.flags = flags_of(options, *address);
    if (options.threads.given()) reader.problem(options.threads, "does not go with --server: the daemon has its own");
    if (options.isa.given()) reader.problem(options.isa, "does not go with --server: the daemon has its own");
    const char* variable = std::getenv("HELIOGRAPH_TOKEN_FILE");
    const std::string file = reader.text(options.token_file).value_or(variable ? variable : "");
    if (!file.empty()) {
      auto token = read_token(file);
      if (!token) reader.problem(options.token_file, token.error().message);
      if (token) connection.connect.token = std::move(*token);
    }
    connection.connect.tls = read_tls(options, reader);
  } else {
    for (const TextOption* option : {&options.wait, &options.token_file, &options.tls_ca, &options.tls_certificate,
                                     &options.tls_key, &options.tls_name}) {
      if (option->given()) reader.problem(*option, "is only valid with --server");
    }
    if (options.tls) reader.problems().add("--tls", "is only valid with --server");
  }
  if (const auto wait = reader.number(options.wait, {0, 3600, false})) {
    connection.connect.retry = true;
    connection.connect.timeout_s = *wait;
  }
  if (const auto threads = reader.integer(options.threads, 1, 1024)) connection.threads = static_cast<int>(*threads);
  if (options.isa.given()) {
    connection.isa = options.isa.text;
    if (const std::string problem = isa_problem(connection.isa); !problem.empty()) reader.problem(options.isa, problem);
  }
  return connection;
}

Renderer::Renderer() = default;
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&& other) noexcept {
  client_ = std::move(other.client_);
  server_ = std::move(other.server_);
  return *this;
}

const std::string& Renderer::http_address() const {
  static const std::string none;
  return server_ ? server_->http_address() : none;
}

Result<Renderer> Renderer::open(const Connection& connection) {
  Renderer renderer;
  if (!connection.address.empty()) {
    auto client = RenderClient::connect(connection.address, connection.connect);
    if (!client) return client.error();
    renderer.client_ = std::move(client).value();
    return renderer;
  }
  ServerConfig config;
  config.listen.clear();
  config.render_threads = connection.threads;
  if (!connection.isa.empty()) config.isa = connection.isa;
  config.oidn_library = connection.oidn_library;
  config.http = connection.http;
  config.scene_roots = connection.scene_roots;
  config.allow_exclusive = connection.allow_exclusive;
  config.vulkan_devices = connection.vulkan_devices;
  config.token = connection.connect.token;
  spdlog::set_level(spdlog::level::off);  // failures come back as statuses, and stdout belongs to the command
  auto server = Server::start(config);
  if (!server) return server.error();
  renderer.server_ = std::move(server).value();
  renderer.client_ =
      std::make_unique<RenderClient>(renderer.server_->in_process_channel(), "in process", connection.connect);
  return renderer;
}

}  // namespace helio::cli
