#include "server/app/daemon.h"

#include <grpc/support/log.h>
#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <cstdint>
#include <cstdlib>

#include "renderer/codec/atomic_file.h"
#include "server/app/server.h"
#include "server/base/build_info.h"

namespace helio {
namespace {

enum ExitCode { kDrained = 0, kCouldNotServe = 1, kBadConfig = 2 };

void set_up_log(const std::string& program, const std::string& level) {
  auto log = spdlog::stderr_color_mt("heliographd");
  log->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
  log->set_level(spdlog::level::from_str(level == "error" ? "err" : level));
  spdlog::set_default_logger(log);
  // What matters of gRPC's own messages comes back as a status; the rest helps in debugging only.
  gpr_set_log_function([](gpr_log_func_args* args) { spdlog::debug("grpc: {}", args->message); });
  spdlog::debug("{} {} {} {}", program, build_version(), build_description(), build_isa());
}

// Every picture takes and frees megabytes of tiles. By itself glibc would return those pages to the system and fault
// them in again, which costs more than encoding. Scenes and films are larger and go back as before.
void keep_freed_tiles() {
  constexpr int kLargestTile = 4 << 20, kKept = 16 << 20;  // bytes; kept: by each of the allocator's arenas
  mallopt(M_MMAP_THRESHOLD, kLargestTile);
  mallopt(M_TRIM_THRESHOLD, kKept);
}

sigset_t stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

// The number appears in one step, so that whoever waits for the file never reads half of it.
Status write_port_file(const std::string& path, const std::string& address) {
  const std::string text = address.substr(address.rfind(':') + 1) + "\n";
  return write_file_atomically(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace

int run_daemon(const std::string& program, const std::vector<std::string>& arguments) {
  auto request = parse_server_config(program, arguments);
  if (!request) {
    std::fprintf(stderr, "%s\n", request.error().to_string().c_str());
    return kBadConfig;
  }
  if (!request->print.empty()) {
    std::fputs(request->print.c_str(), stdout);
    return kDrained;
  }
  const ServerConfig& config = request->config;
  set_up_log(program, config.log_level);
  keep_freed_tiles();
  signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of its write
  // Blocked before any thread exists, so that only sigwait below gets them.
  const sigset_t signals = stop_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  auto server = Server::start(config);
  if (!server) {
    std::fprintf(stderr, "%s: %s\n", program.c_str(), server.error().to_string().c_str());
    return server.error().code == ErrorCode::invalid_argument ? kBadConfig : kCouldNotServe;
  }
  if (!config.port_file.empty()) {
    if (const Status written = write_port_file(config.port_file, (*server)->address()); !written.ok()) {
      std::fprintf(stderr, "%s: port-file: %s\n", program.c_str(), written.error().to_string().c_str());
      return kCouldNotServe;
    }
  }
  const std::string& address = (*server)->address();
  const std::string& http = (*server)->http_address();
  if (request->json) {
    std::printf(http.empty() ? "{\"listening\": \"%s\"}\n" : "{\"listening\": \"%s\", \"http\": \"%s\"}\n",
                address.c_str(), http.c_str());
  } else {
    std::printf("heliographd listening on %s\n", address.c_str());
    if (!http.empty()) std::printf("viewer at http://%s/\n", http.c_str());
  }
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("{}: draining, at most {} s", signal == SIGTERM ? "SIGTERM" : "SIGINT", config.drain_grace_s);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // the next one ends the process at once
  const bool idle = (*server)->drain(config.drain_grace_s);
  spdlog::info("drained");
  if (!idle) {
    // A load cannot be interrupted, nor a connection closed whose peer takes no bytes; nothing of them is worth
    // keeping.
    spdlog::default_logger()->flush();
    std::_Exit(kDrained);
  }
  return kDrained;
}

}  // namespace helio
