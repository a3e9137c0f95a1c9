#include "client/cli/interrupt.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <thread>

namespace helio::cli {

namespace {

// The handler may touch nothing but these (async-signal-safe).
std::atomic<int> g_signal{0};
std::atomic<int> g_wake_fd{-1};

void handle(int signal) {
  const int error = errno;  // of the code that was interrupted
  int expected = 0;
  if (!g_signal.compare_exchange_strong(expected, signal)) _exit(128 + signal);
  const char byte = 's';
  const ssize_t written = write(g_wake_fd.load(), &byte, 1);
  static_cast<void>(written);  // a full pipe wakes the thread as well
  errno = error;
}

}  // namespace

struct Interrupt::Impl {
  int read_fd = -1, write_fd = -1;
  struct sigaction before_int {
  }, before_term{};
  std::thread thread;
};

Interrupt::Interrupt(std::function<void()> on_signal) : impl_(std::make_unique<Impl>()) {
  int fds[2];
  if (pipe2(fds, O_CLOEXEC) != 0) return;  // no descriptors left: signals keep their default action
  impl_->read_fd = fds[0];
  impl_->write_fd = fds[1];
  g_signal = 0;
  g_wake_fd = fds[1];
  impl_->thread = std::thread([fd = fds[0], on_signal = std::move(on_signal)] {
    char byte = 0;
    if (read(fd, &byte, 1) == 1 && byte == 's') on_signal();
  });
  struct sigaction action {};
  action.sa_handler = handle;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, &impl_->before_int);
  sigaction(SIGTERM, &action, &impl_->before_term);
}

Interrupt::~Interrupt() {
  if (!impl_->thread.joinable()) return;
  sigaction(SIGINT, &impl_->before_int, nullptr);
  sigaction(SIGTERM, &impl_->before_term, nullptr);
  const char byte = 'q';
  const ssize_t written = write(impl_->write_fd, &byte, 1);
  static_cast<void>(written);
  impl_->thread.join();
  g_wake_fd = -1;
  close(impl_->read_fd);
  close(impl_->write_fd);
}

bool Interrupt::raised() const {
  return g_signal != 0;
}
int Interrupt::exit_code() const {
  return 128 + g_signal;
}

}  // namespace helio::cli
