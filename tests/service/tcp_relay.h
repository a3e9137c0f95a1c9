// Passes bytes between clients and a daemon until it is told to cut every connection, as the death of a process does.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace helio::test {

class TcpRelay {
 public:
  // The daemon's address on 127.0.0.1; how long a new connection is silent before bytes pass, as over a slow link.
  explicit TcpRelay(const std::string& daemon, double silent_s = 0);
  ~TcpRelay();

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  void cut();

 private:
  void accept_connections(int daemon_port, double silent_s);
  static void pass(int from, int to);

  int listener_ = -1, port_ = 0;
  std::mutex mutex_;
  std::vector<int> sockets_;
  std::vector<std::thread> threads_;
  std::thread acceptor_;
};

}  // namespace helio::test
