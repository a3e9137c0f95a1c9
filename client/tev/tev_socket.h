// A connection to tev that never blocks for longer than it is told to, and never raises SIGPIPE.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "client/tev/tev_address.h"
#include "renderer/base/result.h"

namespace helio {

// Ends waits of another thread.
class WakeUp {
 public:
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  void signal();  // from any thread
  void clear();
  int descriptor() const { return descriptor_; }  // -1: the process has no descriptors left; waits then poll

 private:
  int descriptor_ = -1;
};

class TevSocket {
 public:
  TevSocket() = default;
  ~TevSocket() { close(); }
  TevSocket(const TevSocket&) = delete;
  TevSocket& operator=(const TevSocket&) = delete;

  bool connected() const { return descriptor_ >= 0; }
  // Tries the address's endpoints in their order. `keep_waiting` is asked at least every 0.1 s, with the seconds since
  // the endpoint was first tried. unavailable: none answers.
  Status connect(const TevAddress& address, const std::function<bool(double)>& keep_waiting);
  // Sends what is still queued in the background; the other side then sees the end.
  void close();

  // Sends all bytes of both parts. `keep_waiting` is asked whenever the other side takes nothing, at least every 0.1 s,
  // with the seconds since it last took a byte. unavailable: the connection is lost, or nobody kept waiting; it is
  // closed.
  Status send(std::string_view head, std::string_view rest, const std::function<bool(double)>& keep_waiting);

  // Until a wake-up, the end of the connection, or now_s() is `until_s`. unavailable: the connection is lost, and
  // closed.
  Status wait(WakeUp& wake, double until_s);

 private:
  Status lost(int error);

  int descriptor_ = -1;
};

}  // namespace helio
