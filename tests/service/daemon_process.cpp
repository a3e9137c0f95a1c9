#include "daemon_process.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <thread>

extern char** environ;

namespace helio::test {

DaemonProcess::DaemonProcess(const std::vector<std::string>& arguments, const std::vector<std::string>& environment) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) return;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], 1);
  posix_spawn_file_actions_addclose(&actions, pipe_ends[0]);
  std::vector<std::string> words = {HELIO_DAEMON};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv, envp;
  for (std::string& word : words) argv.push_back(word.data());
  // Of two values the first counts. Without a test's wish, no daemon touches the state folder of whoever runs it.
  std::vector<std::string> variables = environment;
  variables.push_back("HELIOGRAPH_STATE=none");
  for (std::string& variable : variables) envp.push_back(variable.data());
  for (char** variable = environ; *variable; ++variable) envp.push_back(*variable);
  argv.push_back(nullptr);
  envp.push_back(nullptr);
  if (posix_spawn(&pid_, HELIO_DAEMON, &actions, nullptr, argv.data(), envp.data()) != 0) pid_ = -1;
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_ends[1]);
  const std::string prefix = "heliographd listening on ";
  char c;
  while (read(pipe_ends[0], &c, 1) == 1) {
    output_ += c;
    if (c != '\n') continue;
    if (output_.rfind(prefix, 0) == 0) {
      address_ = output_.substr(prefix.size(), output_.size() - prefix.size() - 1);
      break;
    }
  }
  close(pipe_ends[0]);
}

DaemonProcess::~DaemonProcess() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

std::uint64_t DaemonProcess::resident_bytes() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  std::uint64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * std::uint64_t(sysconf(_SC_PAGESIZE));
}

void DaemonProcess::signal(int number) {
  if (pid_ > 0) kill(pid_, number);
}

int DaemonProcess::wait() {
  for (int i = 0; i < 6000 && pid_ > 0; ++i) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return -1;
}

}  // namespace helio::test
