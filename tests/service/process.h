// Runs programs as their users do: arguments, a folder, stdout, stderr (a file or a terminal), signals, exit codes.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace helio::test {

struct ProcessResult {
  int exit_code = -1;  // -1: ended by a signal, or did not end in time and was killed
  int signal = 0;
  std::string out, err;
};

class Process {
 public:
  // all_terminal: stdin and stdout are the same terminal, so that errors() has what either shows, and the process leads a
  // session of its own whose terminal it is.
  enum class Stderr { file, terminal, all_terminal };

  // Starts the program in `folder`, where it also leaves its stdout.
  Process(const std::string& program, const std::vector<std::string>& arguments, const std::string& folder,
          Stderr stderr_kind = Stderr::file);
  ~Process();  // kills what still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send_signal(int signal);
  void type(const std::string& keys);  // of a process whose stdin is a terminal
  void close_terminal();               // as one closes its window: it sends SIGHUP
  // True once stdout (or stderr) holds the text; false after `seconds` or when the process has ended.
  bool wait_for_output(const std::string& text, double seconds = 60);
  bool wait_for_errors(const std::string& text, double seconds = 60);
  ProcessResult wait(double seconds = 60);

  std::string output() const;  // stdout so far
  std::string errors();        // stderr so far

 private:
  bool ended();
  void read_terminal();

  pid_t pid_ = -1;
  bool ended_ = false;
  int status_ = 0;
  int terminal_fd_ = -1;
  std::string terminal_;
  std::string out_path_, err_path_;
};

// False where no pseudo-terminal can be opened, as in a bare chroot without /dev/pts: Stderr::terminal throws there.
bool has_pseudo_terminals();

// Runs to the end.
ProcessResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const std::string& folder);

std::string read_file(const std::string& path);
void write_file(const std::string& path, const std::string& bytes);

// A folder that is removed with what is in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace helio::test
