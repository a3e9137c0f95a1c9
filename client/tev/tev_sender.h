// Shows a picture in tev or HDRView while it comes into being, from a thread of its own, whatever becomes of the
// viewer.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/tev/tev_address.h"
#include "client/tev/tev_packets.h"
#include "client/tev/tev_socket.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

// Seconds.
struct TevTiming {
  double interval_s = 0.1;  // from the start of an update to that of the next, at least
  double retry_s = 5;       // from the end of a connection, or of a try, to the next try
  double connect_s = 2;     // that a connection may take
  double blocked_s = 5;     // without a byte read before that is warned of
  double finish_s = 2;      // that finish() may take
};

struct TevReport {
  std::uint64_t connections = 0;
  std::uint64_t updates = 0;  // bundles of tiles, sent whole
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;
  double thread_seconds = 0;  // processor time of the sender's thread
  std::string warning;        // empty: nothing went wrong
};

// Thread safe. Holds the newest state of each tile and no more than one picture's worth of tiles. Nothing blocks but
// finish(), which is bounded. When the viewer is absent, goes away or does not read, that is warned of once, and tried
// again; a viewer that comes back gets the image and all tiles anew.
class TevSender {
 public:
  // `warn` is called once at most, from the sender's thread, which starts to connect at once.
  TevSender(TevAddress address, std::function<void(const std::string&)> warn, const TevTiming& timing = {});
  ~TevSender();  // finishes
  TevSender(const TevSender&) = delete;
  TevSender& operator=(const TevSender&) = delete;

  // The image that tiles belong to from now on. Another one than before, or one of another size or with other channels,
  // is created in the viewer, and tiles before it are forgotten; the same again changes nothing.
  // Errors: those of check_tev_image().
  Status begin(const TevImage& image);

  // Fills the vector with window.area() floats for each of the image's channels, row by row, one channel after the
  // other.
  using Pixels = std::function<Status(std::vector<float>&)>;
  // The newest state of a tile; what it overlaps is forgotten. `pixels` is called on the sender's thread, when the tile
  // is sent, and again for another connection; a tile whose pixels cannot be had is left out. invalid_argument: no
  // image has begun, or the window is not inside it.
  Status update(const PixelRect& window, Pixels pixels);

  // Sends what is left, takes the borders away and ends the thread, within timing.finish_s and a tenth of a second.
  // Later calls, and those of the other members, do nothing.
  void finish();

  TevReport report() const;

 private:
  struct Tile {
    PixelRect window;
    std::shared_ptr<const Pixels> pixels;
    bool sent = false;
  };

  void run();
  void connect();
  Status send_update();
  Status send(std::string_view head, std::string_view rest);
  bool keep_waiting() const;
  bool anything_to_send() const;
  void lose(const std::string& what);
  void warn_once(const std::string& text);

  const TevAddress address_;
  const std::function<void(const std::string&)> warn_;
  const TevTiming timing_;

  mutable std::mutex mutex_;  // of what follows
  TevImage image_;            // without channels: none has begun
  bool created_ = false;
  std::map<std::pair<int, int>, Tile> tiles_;  // by y0, x0; disjoint
  std::size_t unsent_ = 0;                     // of these
  bool finishing_ = false;
  double finish_by_s_ = 0;  // on the now_s() clock
  bool warned_ = false;
  TevReport report_;

  // The thread's own.
  WakeUp wake_;
  TevSocket socket_;
  double next_try_s_ = 0, next_update_s_ = 0;
  bool focused_ = false;  // an image was created
  bool borders_shown_ = false;
  std::vector<float> planes_;

  std::thread thread_;  // last: it uses what is above
};

}  // namespace helio
