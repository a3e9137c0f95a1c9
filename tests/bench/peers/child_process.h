// A program that runs beside the bench, with its standard input and output in our hands.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio::bench {

// Not thread safe.
class ChildProcess {
 public:
  // arguments[0] is the program, looked for in PATH. Its stderr is ours. not_found when it cannot be started.
  static Result<std::unique_ptr<ChildProcess>> start(const std::vector<std::string>& arguments);
  ~ChildProcess();  // SIGTERM, then waits
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }

  Status write_line(const std::string& line);
  // Without its line end. unavailable: the program closed its output.
  Result<std::string> read_line();
  // Drops what the program still prints and waits for its end. The exit code; -1: ended by a signal.
  int wait();

 private:
  ChildProcess(pid_t pid, int input, int output) : pid_(pid), input_(input), output_(output) {}
  void close_input();

  pid_t pid_;
  int input_, output_;
  bool ended_ = false;
  int exit_code_ = -1;
  std::string buffer_;
};

}  // namespace helio::bench
