// One client's resident picture: settings, budget, newest view and the rendering of it. It outlives its streams.
//
// A session renders while someone listens. When the listener goes, the frame in flight pauses and goes on when the
// session is attached again. An update of a session to which nobody listens is rendered at once if its budget is
// bounded by time or samples, else when someone attaches.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/sessions/render_context.h"
#include "server/stream/convert.h"

namespace helio {

class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(std::string id, std::shared_ptr<RenderContext> rendering, const RenderSettings& settings,
          const Budget& budget, unsigned channels, double grace_s, const RenderLimits& limits, std::string owner = {});

  const std::string& id() const { return id_; }
  // Name of the token of whoever created it; empty: nobody in particular.
  const std::string& owner() const { return owner_; }
  double grace_s() const { return grace_s_; }
  RenderSettings settings() const;

  // Null parts stay unchanged; on error nothing changes. Returns the new revision; from then on no tile of an older one
  // is handed to gRPC. Changing settings may allocate a film, which takes long and blocks only other changes of
  // settings.
  struct Change {
    const pb::View* view = nullptr;
    const pb::RenderSettings* settings = nullptr;
    const pb::Budget* budget = nullptr;
    const pb::StreamRequest::MoveGaze* gaze = nullptr;  // alone: no new revision
    SceneLease* scene = nullptr;  // to be rendered from now on; moved from
  };
  Result<std::uint64_t> update(const Change& change);

  // The stream becomes the session's only listener; the one before ends with ABORTED. Errors: not_found after
  // close(); resource_exhausted when max_memory is reached; permission_denied where there is a listener that the new
  // one may not take over from.
  enum class TakeOver { yes, no };
  Status attach(const std::shared_ptr<OutboundStream>& stream, const TileFormat& format,
                TakeOver take_over = TakeOver::yes);
  // Does nothing when another stream has taken over since.
  void detach(const OutboundStream* stream);
  // The client will send nothing more: the listener's call ends with the frame in flight, or at once when that has no
  // bounded budget.
  void finish_after_frame(const std::shared_ptr<OutboundStream>& stream);

  // The listener gets the notice, the end of the frame in flight, and this status.
  void drain(const grpc::Status& status);

  // For another daemon to go on with. In this order, and never undone:
  // The listener gets the notice and nothing more of frames; changes and listeners are refused with unavailable from
  // now on, and nothing is rendered but for copy_picture().
  void freeze(const std::string& notice);
  struct State {
    RenderSettings settings;
    Budget budget;
    std::optional<View> view;
    bool attached = false;  // somebody listens
  };
  State state() const;
  // Of the view's picture as it is; null: it has no samples. Errors: those of RenderContext::copy_picture().
  Result<std::shared_ptr<const PictureCheckpoint>> copy_picture(double deadline_s);
  bool closed() const;
  SceneLease lease() const;  // of the scene that is rendered
  // The listener's call ends with this status.
  void end_stream(const grpc::Status& status);

  // What a session of an earlier daemon was, of one that was just made: it waits for a listener. `picture` is the
  // view's, null: its samples begin anew; the first listener is told `told`, if that is not empty. The error is
  // PictureCheckpoint::suits()'s, and the samples begin anew then, too.
  Status take_up(const View& view, std::shared_ptr<const PictureCheckpoint> picture, std::string told);
  // The listener's call ends with this status.
  void close(const grpc::Status& status);
  // Closes the session and returns true only if no stream is attached and no attach() or update() is in progress;
  // otherwise returns false.
  bool close_idle(const grpc::Status& status);

  pb::SessionInfo info() const;
  // Bytes that close_idle() would free; 0 when the session is in use.
  std::uint64_t idle_bytes() const;
  // Seconds without a stream; 0 while attached. Never waits.
  double idle_s() const;

 private:
  class InUse;
  // Reads what `change` has; with mutex_ held.
  Status read(const Change& change, RenderLoop::Update& update) const;
  Result<std::uint64_t> move_gaze(const pb::StreamRequest::MoveGaze& message);
  bool changes_rate_alone(const Change& change, const RenderLoop::Update& update) const;
  Error gone() const;
  Error draining() const;
  bool idle_locked() const { return !closed_ && !frozen_ && in_use_ == 0 && !rendering_->publisher().stream(); }
  void close_locked(const grpc::Status& status);
  bool bounded() const { return budget_.time_s || budget_.samples; }
  bool frame_over() const;
  void pause();

  const std::string id_;
  const std::string owner_;
  const double grace_s_;
  const RenderLimits limits_;
  const std::shared_ptr<RenderContext> rendering_;

  std::mutex resize_mutex_;  // one film or layer is made at a time; taken before mutex_
  mutable std::mutex mutex_;
  RenderSettings settings_;
  Budget budget_;
  unsigned channels_;               // that tiles are resolved with
  TileFormat format_;               // of the listener
  std::uint64_t last_view_id_ = 0;  // 0: no view yet
  std::optional<View> view_;        // the newest
  bool restored_ = false;           // the view's picture has samples of an earlier daemon that wait to be taken up
  std::string told_;                // the next listener, of what became of the samples; empty: nothing
  bool frozen_ = false;             // freeze()
  bool paused_ = false;             // a frame was in flight and waits for a listener
  bool closed_ = false;
  int in_use_ = 0;                     // by calls that may let go of mutex_ for a while
  std::atomic<double> idle_since_s_;  // kAttached: somebody listens
};

}  // namespace helio
