// heliographd as a process of its own.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace helio::test {

class DaemonProcess {
 public:
  // `environment` entries are NAME=VALUE, added to the test's own. Waits for the line that tells the address.
  explicit DaemonProcess(const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {});
  ~DaemonProcess();  // kills it when it still runs

  // From its line on stdout; empty when it ended without one.
  const std::string& address() const { return address_; }
  const std::string& output() const { return output_; }
  void signal(int number);
  // Bytes of its memory that are resident.
  std::uint64_t resident_bytes() const;
  // Exit code, or 128 + the signal that ended it; -1 when it does not end within a minute.
  int wait();

 private:
  pid_t pid_ = -1;
  std::string address_, output_;
};

}  // namespace helio::test
