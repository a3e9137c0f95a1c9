// One StreamFrames call: views go in from any thread, frames come out through callbacks.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "heliograph/v1/frame_stream.pb.h"
#include "heliograph/v1/render_service.grpc.pb.h"
#include "renderer/base/result.h"

namespace helio {

// With previews (RenderSettings.preview_rate) two kinds of frames come: frame_begin.preview and tile.preview tell them
// apart; the end of a frame is told by its tag.frame.
//
// Called on the stream's own reading thread, one at a time, in the order of arrival; empty ones are skipped. A callback
// that takes long holds this stream back (the server then drops superseded tiles), nobody else. Callbacks may send on
// the stream, but must not wait for its end.
struct FrameCallbacks {
  std::function<void(const heliograph::v1::Opened&)> opened;
  std::function<void(const heliograph::v1::FrameBegin&)> frame_begin;
  std::function<void(heliograph::v1::Tile)> tile;
  std::function<void(const heliograph::v1::FrameEnd&)> frame_end;
  std::function<void(const heliograph::v1::Notice&)> notice;
  std::function<void(const heliograph::v1::Progress&)> progress;
  // Once, last: the call is over. ok: closed as asked.
  std::function<void(const Status&)> ended;
};

// Passes one response to the callback that wants it.
void dispatch(heliograph::v1::StreamResponse& response, const FrameCallbacks& callbacks);

// Thread safe. RenderClient::stream_frames makes it; it must not outlive that client.
class FrameStream {
 public:
  FrameStream(heliograph::v1::RenderService::StubInterface& stub, std::string peer,
              const heliograph::v1::StreamRequest::Open& open, FrameCallbacks callbacks,
              const std::function<void(grpc::ClientContext&)>& prepare);
  ~FrameStream();  // cancels when the stream is still open; the session lives on
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  // Errors: unavailable (the stream is over; wait() says why).
  Status send_view(const heliograph::v1::View& view);
  Status send_settings(const heliograph::v1::RenderSettings& settings);
  Status send_budget(const heliograph::v1::Budget& budget);
  Status send_credit(std::uint32_t tiles);
  // Another scene from now on, an edited one for instance; view, settings and budget stay.
  Status send_scene(const std::string& scene_id);

  // Asks the server to end the stream, and the session with it when asked to; then wait() returns soon.
  Status close(bool close_session);
  void cancel();
  // Blocks until the call is over. What the server answered: ok after close().
  Status wait();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
