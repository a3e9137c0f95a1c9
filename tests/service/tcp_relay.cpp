#include "tcp_relay.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>

namespace helio::test {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(std::uint16_t(port));
  return address;
}

}  // namespace

TcpRelay::TcpRelay(const std::string& daemon, double silent_s) {
  const int daemon_port = std::stoi(daemon.substr(daemon.rfind(':') + 1));
  listener_ = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(listen(listener_, 8), 0);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  acceptor_ = std::thread([=, this] { accept_connections(daemon_port, silent_s); });
}

TcpRelay::~TcpRelay() {
  shutdown(listener_, SHUT_RDWR);
  acceptor_.join();
  cut();
  for (std::thread& thread : threads_) thread.join();
  for (const int socket : sockets_) close(socket);
  close(listener_);
}

void TcpRelay::accept_connections(int daemon_port, double silent_s) {
  for (int client; (client = accept(listener_, nullptr, nullptr)) >= 0;) {
    std::this_thread::sleep_for(std::chrono::duration<double>(silent_s));
    const int daemon = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = loopback(daemon_port);
    EXPECT_EQ(connect(daemon, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const std::lock_guard lock(mutex_);
    sockets_.push_back(client);
    sockets_.push_back(daemon);
    threads_.emplace_back(pass, client, daemon);
    threads_.emplace_back(pass, daemon, client);
  }
}

void TcpRelay::pass(int from, int to) {
  char buffer[65536];
  for (ssize_t n; (n = recv(from, buffer, sizeof buffer, 0)) > 0;) {
    for (ssize_t sent = 0; sent < n;) {
      const ssize_t more = send(to, buffer + sent, std::size_t(n - sent), MSG_NOSIGNAL);
      if (more <= 0) return;
      sent += more;
    }
  }
}

void TcpRelay::cut() {
  const std::lock_guard lock(mutex_);
  for (const int socket : sockets_) shutdown(socket, SHUT_RDWR);
}

}  // namespace helio::test
