// A heliographd of our own, and what the kernel knows about it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/render_client.h"
#include "tests/bench/bench_context.h"
#include "tests/bench/peers/child_process.h"

namespace helio::bench {

class DaemonProcess {
 public:
  // On a free loopback port, with the bench's threads; waits until it serves. `folder` holds its port file. `more`: of
  // its options.
  static Result<std::unique_ptr<DaemonProcess>> start(const BenchOptions& options, const std::filesystem::path& folder,
                                                      const std::vector<std::string>& more = {});

  Result<std::unique_ptr<RenderClient>> connect(const TlsOptions& tls = {}) const;
  const std::string& address() const { return address_; }

  // Processor time of all its threads since it started, user and system; resolution 10 ms.
  double cpu_seconds() const;
  std::uint64_t resident_bytes() const;

 private:
  DaemonProcess(std::unique_ptr<ChildProcess> process, std::string address)
      : process_(std::move(process)), address_(std::move(address)) {}

  std::unique_ptr<ChildProcess> process_;
  std::string address_;
};

// Uploads a scene; its id.
Result<std::string> upload(RenderClient& client, const std::filesystem::path& file);

}  // namespace helio::bench
