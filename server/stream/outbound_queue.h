// What waits to be sent to one listener: at most one frame of tiles, whatever the listener's pace.
//
// Rules when it fills: a newer state of a tile replaces the older one in its place; a newer frame or revision drops the
// older one's tiles; a frame of which nothing was sent leaves no trace. So the queue holds, at most, the end of the
// frame that the listener knows of and one whole frame. Together with the message in flight that is less than two
// frames of memory.
//
// Previews (FrameBegin::preview) go before the film, and no newer frame or revision drops them: one whose begin was
// popped is sent to its end, and one more waits behind it, which a newer one replaces whole. So two wait at most,
// beside the film's frame. The begin of a preview drops that frame as any newer one does.
//
// Guarantee: once drop_before(r), or push of the begin of a film's frame of revision r, has returned, pop() gives no
// tile of the film of an older revision. After pop() gave the begin of a frame, it gives no tile of any earlier frame.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "renderer/frame/frame_sink.h"
#include "server/metrics/daemon_counters.h"

namespace helio {

struct EncodedTile {
  FrameTag tag;
  PixelRect window;
  std::uint32_t pass = 0;
  bool final = false;
  bool preview = false;
  bool variance = true;  // it has the variance, if its listener asks for any
  std::uint32_t samples_per_pixel = 0;
  std::uint64_t invalid_samples = 0;
  bool jpeg = false;  // `bytes` are a JPEG file, else an EXR file
  std::vector<std::uint8_t> bytes;
  std::uint32_t crc32 = 0;  // of bytes
  // Of what pop() gives: FrameBegin::changed_s, if this is the first tile of its place in a frame; else 0.
  double changed_s = 0;
};

struct FrameReport {
  FrameEnd end;
  std::uint64_t bytes_sent = 0;     // of this frame's tiles
  std::uint64_t dropped_tiles = 0;  // of this frame, superseded before they were sent
  std::string replay_token;         // of the first invalid sample; empty: there was none
};

enum class NoticeSeverity { info, warning, draining };
struct Notice {
  NoticeSeverity severity = NoticeSeverity::info;
  std::string text;
};

// The first message of a stream, made by whoever opened it: serialized StreamResponse or RunJobResponse.
struct Greeting {
  std::string message;
};

using Outbound = std::variant<Greeting, Notice, FrameBegin, FrameProgress, EncodedTile, FrameReport>;

// Thread safe.
class OutboundQueue {
 public:
  using Corner = std::pair<int, int>;  // top left of a tile's window

  // counters: null: nothing is counted. They outlive it.
  explicit OutboundQueue(StreamCounters* counters = nullptr) : counters_(counters) {}

  void push(Greeting greeting);
  void push(Notice notice);  // the newest of a severity replaces an older one that still waits
  void push(const FrameBegin& begin);
  void push(const FrameProgress& progress);  // the newest replaces an older one that still waits
  // Ignored unless the tile is of a frame that waits or is being sent and, of the film, of no revision that
  // drop_before() refuses.
  void push(EncodedTile tile);
  void push(const FrameEnd& end, std::string replay_token = {});

  // Tiles of revisions before this one are no longer wanted.
  void drop_before(std::uint64_t revision);
  bool wants(const FrameTag& tag) const;
  // Of tiles at this corner of the frame, only each n-th that is sent is to have the variance: must the next one? What
  // was replaced before it was sent does not count. True of the first.
  bool variance_due(const FrameTag& tag, Corner corner, int every) const;

  // Switches to flow control by credit with so many tiles; before this call their number is unlimited.
  void limit_credit(std::uint32_t tiles);
  // False if limit_credit() was never called.
  bool add_credit(std::uint32_t tiles);
  // Mean rate of tile bytes; none: unlimited.
  void limit_rate(std::optional<double> bytes_per_second);

  struct Next {
    std::optional<Outbound> message;
    double wait_until_s = 0;  // without a message: when the rate allows the next tile; 0: nothing to wait for
  };
  // The next message to send, in order: greeting, notices, the end of the frame before; of previews and then the film
  // begin, progress, tiles in the order in which their places were taken, end.
  Next pop(double now_s);

  bool empty() const;
  // Drops everything and takes nothing more.
  void close();
  std::size_t tiles() const;         // of the film that wait
  std::uint64_t bytes() const;       // of all tiles that wait
  std::uint64_t peak_bytes() const;  // the most that ever waited

 private:
  struct Frame {
    FrameBegin begin;
    bool begun = false;  // begin was popped
    std::list<EncodedTile> tiles;
    std::map<Corner, std::list<EncodedTile>::iterator> places;
    // Places of which something was sent: how many tiles since the last one with variance.
    std::map<Corner, int> since_variance;
    std::optional<FrameProgress> progress;
    std::optional<FrameEnd> end;
    bool ended = false;  // end was popped
    std::string replay_token;
    std::uint64_t bytes_sent = 0, dropped = 0;

    FrameReport report() const { return {*end, bytes_sent, dropped, replay_token}; }  // once ended
  };

  void drop_tiles(Frame& frame);
  void note_dropped(Frame& frame, std::size_t tiles);
  void retire_frame();
  void push_preview(Frame preview);
  // Previews whose makers have begun something else will not be told to have ended, as where memory was out.
  void end_previews();
  Frame* frame_of(const FrameTag& tag);  // that still takes tiles and its end; null: none
  const Frame* frame_of(const FrameTag& tag) const { return const_cast<OutboundQueue*>(this)->frame_of(tag); }
  Next pop(Frame& frame, double now_s);
  Next pop_tile(Frame& frame, double now_s);

  StreamCounters* const counters_;
  mutable std::mutex mutex_;
  std::optional<Greeting> greeting_;
  std::map<NoticeSeverity, Notice> notices_;
  std::optional<FrameReport> previous_end_;
  std::list<Frame> previews_;  // two at most; only of the first was the begin popped
  std::optional<Frame> frame_;
  std::uint64_t min_revision_ = 0;
  std::uint64_t bytes_ = 0, peak_bytes_ = 0;
  std::optional<std::uint64_t> credit_;
  std::optional<double> rate_;
  double rate_free_s_ = 0;  // when the next tile may go
  bool closed_ = false;
};

}  // namespace helio
