#include "process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "renderer/base/clock.h"

extern char** environ;

namespace helio::test {

namespace {

std::atomic<int> g_counter{0};

// The controlling side of a new pseudo-terminal, -1 when there is none to be had.
int open_terminal() {
  const int fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return -1;
  if (grantpt(fd) == 0 && unlockpt(fd) == 0 && access(ptsname(fd), R_OK | W_OK) == 0) return fd;
  close(fd);
  return -1;
}

void pause_a_little() {
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

}  // namespace

Process::Process(const std::string& program, const std::vector<std::string>& arguments, const std::string& folder,
                 Stderr stderr_kind) {
  const std::string stem = folder + "/.process" + std::to_string(g_counter++);
  out_path_ = stem + ".out";
  err_path_ = stem + ".err";

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (stderr_kind != Stderr::file) {
    terminal_fd_ = open_terminal();
    if (terminal_fd_ < 0) throw std::runtime_error("no pseudo-terminal");
    // The first terminal that the leader of a session opens becomes the session's.
    const bool controls = stderr_kind == Stderr::all_terminal;
    for (int fd = controls ? 0 : 2; fd <= 2; ++fd)
      posix_spawn_file_actions_addopen(&actions, fd, ptsname(terminal_fd_), controls ? O_RDWR : O_RDWR | O_NOCTTY, 0);
  } else {
    posix_spawn_file_actions_addopen(&actions, 2, err_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  }
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());

  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (stderr_kind == Stderr::all_terminal) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  const int problem = posix_spawn(&pid_, program.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) throw std::runtime_error("cannot start " + program);
}

Process::~Process() {
  if (!ended()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, &status_, 0);
  }
  if (terminal_fd_ >= 0) close(terminal_fd_);
}

void Process::send_signal(int signal) {
  if (!ended()) kill(pid_, signal);
}

void Process::type(const std::string& keys) {
  if (write(terminal_fd_, keys.data(), keys.size()) != ssize_t(keys.size())) throw std::runtime_error("cannot type");
}

void Process::close_terminal() {
  read_terminal();
  close(terminal_fd_);
  terminal_fd_ = -1;
}

bool Process::ended() {
  if (!ended_) ended_ = waitpid(pid_, &status_, WNOHANG) == pid_;
  return ended_;
}

void Process::read_terminal() {
  char buffer[4096];
  ssize_t bytes;
  while (terminal_fd_ >= 0 && (bytes = read(terminal_fd_, buffer, sizeof buffer)) > 0) terminal_.append(buffer, bytes);
}

std::string Process::output() const {
  return read_file(out_path_);
}

std::string Process::errors() {
  read_terminal();
  return terminal_fd_ >= 0 || !terminal_.empty() ? terminal_ : read_file(err_path_);
}

bool Process::wait_for_output(const std::string& text, double seconds) {
  for (const double deadline = now_s() + seconds; now_s() < deadline; pause_a_little()) {
    const bool over = ended();
    if (output().find(text) != std::string::npos) return true;
    if (over) return false;
  }
  return false;
}

bool Process::wait_for_errors(const std::string& text, double seconds) {
  for (const double deadline = now_s() + seconds; now_s() < deadline; pause_a_little()) {
    const bool over = ended();
    if (errors().find(text) != std::string::npos) return true;
    if (over) return false;
  }
  return false;
}

ProcessResult Process::wait(double seconds) {
  const double deadline = now_s() + seconds;
  while (!ended() && now_s() < deadline) {
    read_terminal();  // a full terminal would stop the process
    pause_a_little();
  }
  if (!ended()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, &status_, 0);
    ended_ = true;
  }
  ProcessResult result;
  if (WIFEXITED(status_)) result.exit_code = WEXITSTATUS(status_);
  if (WIFSIGNALED(status_)) result.signal = WTERMSIG(status_);
  result.out = output();
  result.err = errors();
  return result;
}

bool has_pseudo_terminals() {
  const int fd = open_terminal();
  if (fd >= 0) close(fd);
  return fd >= 0;
}

ProcessResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const std::string& folder) {
  return Process(program, arguments, folder).wait();
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

void write_file(const std::string& path, const std::string& bytes) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "heliograph-test-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace helio::test
