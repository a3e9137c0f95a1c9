// Ctrl-C and SIGTERM, turned into a call on an ordinary thread.
#pragma once

#include <functional>
#include <memory>

namespace helio::cli {

// At most one at a time. The first signal calls `on_signal` on a thread of its own (it may take locks and make calls);
// the second ends the process at once with 128 + the signal's number.
class Interrupt {
 public:
  explicit Interrupt(std::function<void()> on_signal);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  bool raised() const;
  int exit_code() const;  // 130 or 143. Precondition: raised()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio::cli
