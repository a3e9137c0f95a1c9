#include "tests/bench/peers/daemon_process.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "renderer/base/clock.h"

namespace helio::bench {

Result<std::unique_ptr<DaemonProcess>> DaemonProcess::start(const BenchOptions& options,
                                                            const std::filesystem::path& folder,
                                                            const std::vector<std::string>& more) {
  const std::filesystem::path port_file = folder / "port";
  std::filesystem::remove(port_file);
  std::vector<std::string> command = {options.daemon,       "--listen",         "127.0.0.1:0",
                                      "--port-file",        port_file.string(), "--render-threads",
                                      std::to_string(options.threads), "--log-level", "error"};
  // Without a wish, no bench touches the state folder of whoever runs it.
  if (std::find(more.begin(), more.end(), "--state") == more.end()) command.insert(command.end(), {"--state", "none"});
  command.insert(command.end(), more.begin(), more.end());
  auto process = ChildProcess::start(command);
  if (!process) return process.error();
  for (const double started = now_s(); now_s() - started < 30;) {
    std::ifstream file(port_file);
    if (std::string port; file >> port) {
      return std::unique_ptr<DaemonProcess>(new DaemonProcess(std::move(process).value(), "127.0.0.1:" + port));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return Error{ErrorCode::unavailable, "did not serve within 30 s", options.daemon};
}

Result<std::unique_ptr<RenderClient>> DaemonProcess::connect(const TlsOptions& tls) const {
  ConnectOptions options;
  options.tls = tls;
  options.retry = true;
  return RenderClient::connect(address_, options);
}

double DaemonProcess::cpu_seconds() const {
  std::ifstream file("/proc/" + std::to_string(process_->pid()) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  // proc(5): the fields after the command's closing parenthesis start with the 3rd, user time is the 14th.
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string skipped;
  for (int field = 3; field < 14; ++field) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / double(sysconf(_SC_CLK_TCK));
}

std::uint64_t DaemonProcess::resident_bytes() const {
  std::ifstream file("/proc/" + std::to_string(process_->pid()) + "/statm");
  std::uint64_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * std::uint64_t(sysconf(_SC_PAGESIZE));
}

Result<std::string> upload(RenderClient& client, const std::filesystem::path& file) {
  const auto local = collect_local_scene(file.string(), "");
  if (!local) return local.error();
  const auto loaded = client.upload_scene(local.value());
  if (!loaded) return loaded.error();
  return loaded.value().scene().scene_id();
}

}  // namespace helio::bench
