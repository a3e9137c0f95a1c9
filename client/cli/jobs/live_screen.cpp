#include "client/cli/jobs/live_screen.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "renderer/base/clock.h"

namespace helio::cli {

namespace {

// ECMA-48, and xterm's private modes.
constexpr const char* kEnter = "\033[?1049h\033[?25l";  // the other screen, no cursor
constexpr const char* kLeave = "\033[?25h\033[?1049l";
constexpr const char* kHome = "\033[H";
constexpr const char* kEraseLine = "\033[K";
constexpr const char* kEraseBelow = "\033[J";

}  // namespace

TerminalSize terminal_size() {
  struct winsize size {};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) return {};
  return {size.ws_row, size.ws_col};
}

struct LiveScreen::Impl {
  bool keyboard = false;  // stdin is a terminal, whose settings were changed
  struct termios before {};
  int read_fd = -1, write_fd = -1;
};

LiveScreen::LiveScreen() : impl_(std::make_unique<Impl>()) {
  int fds[2];
  if (pipe2(fds, O_CLOEXEC | O_NONBLOCK) == 0) {
    impl_->read_fd = fds[0];
    impl_->write_fd = fds[1];
  }
  // Keys come one by one, and are not shown; Ctrl-C stays a signal.
  if (tcgetattr(STDIN_FILENO, &impl_->before) == 0) {
    struct termios keys = impl_->before;
    keys.c_lflag &= ~tcflag_t(ICANON | ECHO);
    keys.c_cc[VMIN] = 0;
    keys.c_cc[VTIME] = 0;
    impl_->keyboard = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
  }
  std::fputs(kEnter, stdout);
  std::fflush(stdout);
}

LiveScreen::~LiveScreen() {
  std::fputs(kLeave, stdout);
  std::fflush(stdout);
  if (impl_->keyboard) tcsetattr(STDIN_FILENO, TCSANOW, &impl_->before);
  if (impl_->read_fd >= 0) close(impl_->read_fd);
  if (impl_->write_fd >= 0) close(impl_->write_fd);
}

void LiveScreen::draw(const std::vector<std::string>& lines) {
  const auto rows = std::size_t(terminal_size().rows);
  std::string page = kHome;
  for (std::size_t i = 0; i < lines.size() && i < rows; ++i) {
    if (i > 0) page += "\r\n";
    page += lines[i] + kEraseLine;
  }
  page += kEraseBelow;
  std::fputs(page.c_str(), stdout);
  std::fflush(stdout);
}

bool LiveScreen::quits_within(double seconds) {
  const double end = now_s() + seconds;
  for (;;) {
    const double left = end - now_s();
    if (left <= 0) return false;
    struct pollfd fds[2] = {{impl_->keyboard ? STDIN_FILENO : -1, POLLIN, 0}, {impl_->read_fd, POLLIN, 0}};
    if (poll(fds, 2, int(std::ceil(std::min(left, 60.0) * 1000))) <= 0) continue;
    char bytes[64];
    if (fds[1].revents != 0) {
      while (read(impl_->read_fd, bytes, sizeof(bytes)) > 0) {
      }
      return false;
    }
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof(bytes));
    if (count <= 0) {
      impl_->keyboard = false;  // it is gone
      continue;
    }
    if (std::any_of(bytes, bytes + count, [](char key) { return key == 'q' || key == 'Q'; })) return true;
  }
}

void LiveScreen::wake() {
  const char byte = 'w';
  const ssize_t written = write(impl_->write_fd, &byte, 1);
  static_cast<void>(written);  // a full pipe wakes as well
}

}  // namespace helio::cli
