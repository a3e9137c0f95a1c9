// A program that is started, spoken with by lines, and ended within a time limit, whatever it does.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "renderer/base/result.h"

namespace helio::vulkan {

class ChildProcess {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Starts the program: its standard input and output are the lines, its standard error is dropped, and it inherits no
  // other descriptor and no blocked signal.
  static Result<ChildProcess> start(const std::filesystem::path& program);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();  // kills it where it still runs, and waits

  // Writes a line; false where the program takes no input any more.
  bool write_line(const std::string& line, Time deadline);

  enum class Read {
    line,
    end,       // it closed its output: it ended, or crashed
    late,      // nothing until the deadline
    too_much,  // more than a megabyte without a line's end
  };
  Read read_line(std::string& line, Time deadline);

  // Waits for the program to end, and kills it at the deadline. "" where it ended by itself with exit code 0; otherwise
  // a clause that says how it ended: "ended with exit code 3", "crashed (SIGSEGV)", "was killed: it did not end in
  // time".
  std::string finish(Time deadline);

 private:
  ChildProcess() = default;

  pid_t process_ = -1;
  int socket_ = -1;
  std::string buffered_;
};

}  // namespace helio::vulkan
