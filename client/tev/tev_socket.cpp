#include "client/tev/tev_socket.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "renderer/base/clock.h"

namespace helio {

namespace {

constexpr double kLook = 0.1;  // seconds, at most, between two questions whether to wait on

int milliseconds_until(double until_s) {
  return int(std::clamp((until_s - now_s()) * 1e3 + 1, 0.0, 1e6));
}

std::string text_of(int error) {
  return std::generic_category().message(error);
}

// A port of the system's own range may be given to the very socket that tries it, which then talks to itself.
bool is_own_echo(int descriptor) {
  sockaddr_storage here{}, there{};
  socklen_t here_size = sizeof here, there_size = sizeof there;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&here), &here_size) != 0 || here.ss_family == AF_UNIX ||
      getpeername(descriptor, reinterpret_cast<sockaddr*>(&there), &there_size) != 0)
    return false;
  return here_size == there_size && std::memcmp(&here, &there, here_size) == 0;
}

// 0, or why there is no connection.
int finish_connecting(int descriptor, const std::function<bool(double)>& keep_waiting) {
  const double begun_s = now_s();
  pollfd wanted{descriptor, POLLOUT, 0};
  while (poll(&wanted, 1, int(kLook * 1e3)) <= 0) {
    if (!keep_waiting(now_s() - begun_s)) return ETIMEDOUT;
  }
  int error = 0;
  socklen_t size = sizeof error;
  return getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

}  // namespace

WakeUp::WakeUp() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

WakeUp::~WakeUp() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void WakeUp::signal() {
  const eventfd_t one = 1;
  if (descriptor_ >= 0) static_cast<void>(eventfd_write(descriptor_, one));  // full: it is signalled already
}

void WakeUp::clear() {
  eventfd_t count = 0;
  if (descriptor_ >= 0) static_cast<void>(eventfd_read(descriptor_, &count));
}

Status TevSocket::connect(const TevAddress& address, const std::function<bool(double)>& keep_waiting) {
  close();
  int error = EADDRNOTAVAIL;
  for (const TevAddress::Endpoint& endpoint : address.endpoints) {
    descriptor_ = socket(endpoint.bytes.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor_ < 0) {
      error = errno;
      continue;
    }
    error = 0;
    if (::connect(descriptor_, reinterpret_cast<const sockaddr*>(&endpoint.bytes), endpoint.size) != 0) error = errno;
    if (error == EINPROGRESS) error = finish_connecting(descriptor_, keep_waiting);
    if (error == 0 && is_own_echo(descriptor_)) error = ECONNREFUSED;
    if (error == 0) {
      const int on = 1;
      if (endpoint.bytes.ss_family != AF_UNIX) setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      return ok_status();
    }
    close();
  }
  return Error{ErrorCode::unavailable, text_of(error), "tev"};
}

void TevSocket::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

Status TevSocket::lost(int error) {
  close();
  return Error{ErrorCode::unavailable, text_of(error), "tev"};
}

Status TevSocket::send(std::string_view head, std::string_view rest, const std::function<bool(double)>& keep_waiting) {
  double took_s = now_s();
  while (!head.empty() || !rest.empty()) {
    iovec parts[2] = {{const_cast<char*>(head.data()), head.size()}, {const_cast<char*>(rest.data()), rest.size()}};
    msghdr message{};
    message.msg_iov = parts;
    message.msg_iovlen = 2;
    const ssize_t sent = sendmsg(descriptor_, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      const std::size_t of_head = std::min(std::size_t(sent), head.size());
      head.remove_prefix(of_head);
      rest.remove_prefix(std::size_t(sent) - of_head);
      took_s = now_s();
      continue;
    }
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return lost(errno);
    if (!keep_waiting(now_s() - took_s)) return lost(ETIMEDOUT);
    pollfd wanted{descriptor_, POLLOUT, 0};
    static_cast<void>(poll(&wanted, 1, int(kLook * 1e3)));  // what went wrong is told by the next sendmsg
  }
  return ok_status();
}

Status TevSocket::wait(WakeUp& wake, double until_s) {
  pollfd wanted[2] = {{wake.descriptor(), POLLIN, 0}, {descriptor_, POLLIN | POLLRDHUP, 0}};
  int timeout = milliseconds_until(until_s);
  if (wake.descriptor() < 0) timeout = std::min(timeout, int(kLook * 1e3));
  if (poll(wanted, 2, timeout) < 0) return ok_status();  // interrupted: the caller looks again
  wake.clear();
  if (descriptor_ < 0 || wanted[1].revents == 0) return ok_status();
  // Nothing is expected; what comes all the same is read, because unread bytes would turn the end into a reset.
  char ignored[4096];
  const ssize_t got = recv(descriptor_, ignored, sizeof ignored, MSG_DONTWAIT);
  if (got > 0 || (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR))) return ok_status();
  return lost(got == 0 ? ECONNRESET : errno);
}

}  // namespace helio
