// Stands in for tev: takes packets on a socket and puts images together.
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/tev_packet_reader.h"

namespace helio::test {

struct TevReceivedImage {
  int width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<std::vector<float>> planes;  // as channels; NaN where nothing came
  std::vector<TevPacket::Command> drawn;
  int created = 0;                   // times
  int updates = 0;                   // packets with pixels
  int drawings = 0;                  // packets with vector graphics
  std::vector<double> drawn_with_s;  // now_s() of drawings that are not empty
  bool grabbed = false;

  const std::vector<float>& plane(const std::string& channel) const;  // fails the test and is empty where there is none
};

class TevReceiver {
 public:
  // On 127.0.0.1, at this port; 0: any. `receive_buffer`: bytes, 0: the system's choice.
  explicit TevReceiver(int port = 0, int receive_buffer = 0);
  // On a Unix socket.
  explicit TevReceiver(const std::string& path);
  ~TevReceiver();
  TevReceiver(const TevReceiver&) = delete;
  TevReceiver& operator=(const TevReceiver&) = delete;

  int port() const { return port_; }
  std::string address() const;  // as of --tev

  void read(bool on);  // off: connections stay open and are not read
  void cut();          // ends the connections that are open; new ones are taken
  void stop();         // and listens no more; what came can still be asked for

  // True once `wanted` holds of what came; false after `seconds`.
  using Images = std::map<std::string, TevReceivedImage>;
  bool wait_for(const std::function<bool(const Images&)>& wanted, double seconds = 30);
  Images images() const;
  std::vector<std::string> errors() const;  // packets that were refused, updates of images that do not exist
  int connections() const;                  // so far

 private:
  void listen_at(int descriptor, const void* address, std::size_t size, int receive_buffer);
  void run();
  void read_from(int descriptor, std::string& pending, bool& open);
  void take(const TevPacket& packet);

  int listener_ = -1, wake_ = -1, port_ = 0;
  std::string path_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Images images_;
  std::vector<std::string> errors_;
  int connections_ = 0;
  bool reading_ = true, cutting_ = false, stopping_ = false;
  std::thread thread_;
};

}  // namespace helio::test
