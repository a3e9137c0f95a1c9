#include "server/app/daemon.h"

#include <fcntl.h>
#include <grpc/support/log.h>
#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "renderer/base/clock.h"
#include "renderer/codec/atomic_file.h"
#include "server/app/server.h"
#include "server/base/build_info.h"
#include "server/base/log_format.h"

namespace helio {
namespace {

enum ExitCode { kDrained = 0, kCouldNotServe = 1, kBadConfig = 2 };

void set_up_log(const std::string& program, const std::string& level, LogFormat format) {
  auto log = spdlog::stderr_color_mt("heliographd");
  log->set_formatter(make_log_formatter(format));
  if (format == LogFormat::json) {  // what spdlog says by itself would be no JSON
    log->set_error_handler([](const std::string&) {
      std::fputs("{\"level\":\"error\",\"message\":\"a line of the log was lost\"}\n", stderr);
    });
  }
  log->set_level(spdlog::level::from_str(level == "error" ? "err" : level));
  spdlog::set_default_logger(log);
  // What matters of gRPC's own messages comes back as a status; the rest helps in debugging only.
  gpr_set_log_function([](gpr_log_func_args* args) { spdlog::debug("grpc: {}", args->message); });
  spdlog::debug("{} version={} build={} isa={}", program, build_version(), logged(build_description()), build_isa());
}

// Every picture takes and frees megabytes of tiles. By itself glibc would return those pages to the system and fault
// them in again, which costs more than encoding. Scenes and films are larger and go back as before.
void keep_freed_tiles() {
  constexpr int kLargestTile = 4 << 20, kKept = 16 << 20;  // bytes; kept: by each of the allocator's arenas
  mallopt(M_MMAP_THRESHOLD, kLargestTile);
  mallopt(M_TRIM_THRESHOLD, kKept);
}

// The terminal that the daemon was started from. Its end sends SIGHUP, as does a service manager that wants files read
// again.
class StartTerminal {
 public:
  // Before SIGHUP is blocked. Programs that were started to outlive the terminal (nohup) ignore its end.
  StartTerminal() {
    struct sigaction action {};
    sigaction(SIGHUP, nullptr, &action);
    watched_ = action.sa_handler != SIG_IGN && opens();
  }
  bool is_gone() const { return watched_ && !opens(); }

 private:
  static bool opens() {
    const int file = open("/dev/tty", O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (file < 0) return errno == EMFILE || errno == ENFILE;  // without a free descriptor nothing is known
    close(file);
    return true;
  }

  bool watched_ = false;
};

sigset_t awaited_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, signal);
  return signals;
}

// The next one ends the process at once, also the first one of a container, to which default actions do not apply.
void end_at_next(const sigset_t& signals) {
  struct sigaction action {};
  action.sa_handler = [](int number) {
    ::signal(number, SIG_DFL);
    sigset_t one;
    sigemptyset(&one);
    sigaddset(&one, number);
    pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
    raise(number);
    _exit(128 + number);
  };
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) {
    struct sigaction before {};
    if (sigaction(number, &action, &before) == 0 && before.sa_handler == SIG_IGN) sigaction(number, &before, nullptr);
  }
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

std::string name_of(int signal) {
  return signal == SIGTERM ? "SIGTERM" : signal == SIGINT ? "SIGINT" : "SIGHUP";
}

// What a program reads that waits for the daemon.
std::string to_json(const Server& server) {
  std::string json = "{\"listening\": \"" + server.address() + "\"";
  if (!server.http_address().empty()) json += ", \"http\": \"" + server.http_address() + "\"";
  return json + ", \"tls\": " + (server.tls() ? "true}" : "false}");
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
  const LogFormat log_format = config.log_format == "json" ? LogFormat::json : LogFormat::text;
  set_up_log(program, config.log_level, log_format);
  keep_freed_tiles();
  signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of its write
  // Blocked before any thread exists, so that only sigwait below gets them.
  const StartTerminal terminal;
  const sigset_t signals = awaited_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  auto server = Server::start(config);
  const auto failed = [&](const std::string& reason) {
    if (log_format == LogFormat::json) {
      const std::string line = "the daemon cannot serve error=" + logged(reason);  // at every level
      std::fprintf(stderr, "%s\n", json_line(line, "critical", std::chrono::system_clock::now()).c_str());
    } else {
      std::fprintf(stderr, "%s: %s\n", program.c_str(), reason.c_str());
    }
  };
  if (!server) {
    failed(server.error().to_string());
    return server.error().code == ErrorCode::invalid_argument ? kBadConfig : kCouldNotServe;
  }
  if (!config.port_file.empty()) {
    if (const Status written = write_port_file(config.port_file, (*server)->address()); !written.ok()) {
      failed("port-file: " + written.error().to_string());
      return kCouldNotServe;
    }
  }
  const std::string& http = (*server)->http_address();
  if (request->json) {
    std::printf("%s\n", to_json(**server).c_str());
  } else {
    std::printf("heliographd listening on %s\n", (*server)->address().c_str());
    if (!http.empty()) std::printf("viewer at %s://%s/\n", (*server)->tls() ? "https" : "http", http.c_str());
  }
  std::fflush(stdout);
  spdlog::info("serving address={} http={} version={} pid={}", (*server)->address().empty() ? "none" : (*server)->address(),
               http.empty() ? "none" : http, build_version(), getpid());

  int signal = 0;
  while (sigwait(&signals, &signal) == 0 && signal == SIGHUP && !terminal.is_gone()) (*server)->reload();
  spdlog::info("draining signal={} grace_s={}", name_of(signal), config.drain_grace_s);
  const double began = now_s();
  end_at_next(signals);
  const bool idle = (*server)->drain(config.drain_grace_s);
  spdlog::info("drained seconds={:.3f} idle={}", now_s() - began, idle);
  if (!idle) {
    // A load cannot be interrupted, nor a connection closed whose peer takes no bytes; nothing of them is worth
    // keeping.
    spdlog::default_logger()->flush();
    std::_Exit(kDrained);
  }
  return kDrained;
}

}  // namespace helio
