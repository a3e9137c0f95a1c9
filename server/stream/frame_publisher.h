// The daemon's FrameSink: encodes tiles for whoever listens and puts them into the listener's queue. Nothing is encoded
// while nobody listens.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "renderer/frame/frame_sink.h"
#include "server/stream/outbound_stream.h"
#include "server/stream/tile_encoder.h"

namespace helio {

class FramePublisher final : public FrameSink {
 public:
  enum class Tiles { all, final_only };
  // Makes the token by which a sample of the frame can be traced again.
  using MakeToken = std::function<std::string(const FrameBegin& frame, const InvalidSample& sample)>;
  // counters: of a session's pictures, which outlive this; null: how old pictures are is not measured.
  explicit FramePublisher(Tiles tiles = Tiles::all, MakeToken make_token = {}, StreamCounters* counters = nullptr)
      : tiles_(tiles), make_token_(std::move(make_token)), counters_(counters) {}

  // Where frames go from now on; returns the stream that they went to before. When a frame is in flight, the new
  // listener is told of its begin.
  std::shared_ptr<OutboundStream> attach(std::shared_ptr<OutboundStream> stream, const TileFormat& format);
  // False when another stream has taken over since.
  bool detach(const OutboundStream* stream);
  std::shared_ptr<OutboundStream> stream() const;

  // The listener's call ends with OK once the end of a frame of this or a later revision has been sent.
  void finish_after(std::uint64_t revision);
  // The loop has been cancelled: the listener's call ends with `status` behind the end of the frame that it knows of.
  // With `tell`, it is told of an end even when no frame had begun, or when more frames were to come.
  void finish_cancelled(const grpc::Status& status, bool tell);

  // The listener is told nothing more of frames; its call goes on.
  void mute();

  // The listener is told now, and all listeners with the end of every frame from now on.
  void tell(const std::string& notice);

  // Of the film's frame that ended last; nothing before the first end.
  std::optional<FrameEnd> last_end() const;
  // The newest state is about to be published again, with an end of its own.
  void forget_end();

  void frame_begun(const FrameBegin& begin) override;
  void tile_ready(FrameTile tile) override;
  void frame_ended(const FrameEnd& end) override;
  std::size_t backlog() const override;

 private:
  bool in_flight() const;  // with mutex_ held

  const Tiles tiles_;
  const MakeToken make_token_;
  StreamCounters* const counters_;

  mutable std::mutex mutex_;
  std::shared_ptr<OutboundStream> stream_;
  TileFormat format_;
  // The end of a preview is not that of its view, and ends no call. changed_s: until the first tile has come.
  std::optional<FrameBegin> begin_;    // of the newest frame of the film
  std::optional<FrameEnd> end_;        // of the newest frame of the film that has ended
  std::optional<FrameBegin> preview_;  // that is being made
  std::string notice_;                 // tell()
  std::optional<std::uint64_t> finish_after_;
  grpc::Status finish_status_;
  bool over_ = false;  // no frame after a cancel, or after mute()
};

}  // namespace helio
