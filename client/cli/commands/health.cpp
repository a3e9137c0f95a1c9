// heliograph health: whether a daemon takes new work, for probes of containers and for scripts.
#include <spdlog/fmt/fmt.h>

#include <memory>

#include "client/cli/command.h"
#include "client/cli/connection.h"
#include "client/cli/exit_code.h"
#include "client/cli/terminal.h"
#include "client/health/service_health.h"

namespace helio::cli {

namespace {

constexpr double kDefaultTimeout = 5;
constexpr std::size_t kMaxService = 256;

struct HealthOptions {
  ConnectionOptions connection;
  TextOption service, timeout;
  bool json = false;
};

constexpr const char* kHelp =
    "Asks the daemon's grpc.health.v1.Health, which answers without a token. Exit code 0: it serves; 1: it does not,\n"
    "as while it drains; 4: nobody answers.\n"
    "With --json, stdout holds one object: server, service, serving (true or false).\n"
    "Example, in a Dockerfile: HEALTHCHECK CMD heliograph health --server 127.0.0.1:50051\n\n";

int run(const CLI::App& app, const HealthOptions& options) {
  Terminal terminal(options.json);
  Problems problems;
  OptionReader reader(problems);
  report_unknown(app, reader);
  Connection connection = read_connection(options.connection, reader);
  const std::string service = options.service.given() ? reader.text(options.service).value_or("") : "";
  if (service.size() > kMaxService)
    reader.problem(options.service, fmt::format("{} bytes; allowed: at most {}", service.size(), kMaxService));
  const double timeout_s = reader.number(options.timeout, {0, 3600, false}).value_or(kDefaultTimeout);
  if (!problems.empty()) return terminal.fail(kUsage, problems.to_error().message);

  if (!options.connection.wait.given()) connection.connect.timeout_s = timeout_s;
  connection.connect.call_timeout_s = timeout_s;
  Json json = {{"server", connection.address}, {"service", service}, {"serving", false}};
  auto renderer = Renderer::open(connection);
  if (!renderer) return terminal.fail(exit_code_of(renderer.error()), renderer.error().to_string(), json);
  const auto serving = is_serving(*renderer->client().link(), service);
  if (!serving) {
    if (serving.error().code == ErrorCode::not_found)
      return terminal.fail(kFailed, "--service: " + serving.error().message, json);
    return terminal.fail(exit_code_of(serving.error()), serving.error().to_string(), json);
  }
  const std::string what = service.empty() ? "the daemon" : service;
  if (!*serving) {
    return terminal.fail(kFailed,
                         fmt::format("{} at {} does not serve: it drains, or is not ready{}", what,
                                     connection.address,
                                     service.ends_with("jobs") ? ", or its state folder takes no changes" : ""),
                         json);
  }
  json["serving"] = true;
  terminal.say(fmt::format("{} at {} serves", what, connection.address));
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_health(CLI::App& root) {
  CLI::App* app =
      add_command(root, "health", "Tell whether a daemon takes new work", std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<HealthOptions>();
  add_daemon_options(*app, options->connection);
  add_text(*app, options->service, "--service", "NAME",
           "Service to ask for, such as heliograph.v1.RenderService. Default: the daemon as a whole");
  add_text(*app, options->timeout, "--timeout", "SECONDS",
           "Longest wait for a connection, and for the answer, (0, 3600]. Default: 5");
  add_flag(*app, options->json, "--json", "One JSON object on stdout, described below");
  allow_unknown(*app);
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
