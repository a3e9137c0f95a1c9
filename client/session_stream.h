// A FrameStream that outlives a planned restart of the daemon: it attaches to the same session of the next one, which
// goes on with the picture, and sends what the daemon before did not take.
#pragma once

#include <functional>
#include <memory>

#include "client/frame_stream.h"
#include "client/render_client.h"

namespace helio {

struct ReattachOptions {
  // Seconds, >= 0, in which a daemon that restarts is asked for the session again; 0: it is not.
  double patience_s = 60;
  // Called on the stream's own thread: the daemon restarts, with its words | the session goes on.
  std::function<void(const Status&)> lost;
  std::function<void()> back;
};

// Thread safe. It must not outlive the client.
//
// Callbacks are those of FrameStream, with these differences: `opened` comes after each attachment, and then the
// picture of the view in hand from its beginning, as a frame of a revision that may be lower than before; `ended` comes
// once, at last. A stream that ends otherwise than by a daemon which says that it restarts, as when that is killed, is
// over.
class SessionStream {
 public:
  SessionStream(RenderClient& client, const heliograph::v1::StreamRequest::Open& open, FrameCallbacks callbacks,
                ReattachOptions options);
  ~SessionStream();  // as of FrameStream
  SessionStream(const SessionStream&) = delete;
  SessionStream& operator=(const SessionStream&) = delete;

  // While there is no daemon the newest of each is kept and sent later. unavailable: the stream is over.
  Status send_view(const heliograph::v1::View& view);
  Status send_budget(const heliograph::v1::Budget& budget);
  // As of FrameStream; a stream that is between two daemons ends at once.
  Status close(bool close_session);
  // Blocks until the stream is over: ok after close(); unavailable: the daemon went away for longer than `patience_s`,
  // or came back without the session.
  Status wait();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
