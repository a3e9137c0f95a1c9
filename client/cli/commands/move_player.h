// Plays views over one StreamFrames stream: each is rendered to its budget before the next is sent.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/camera_path.h"
#include "client/cli/terminal.h"
#include "client/frame_assembler.h"
#include "client/session_stream.h"
#include "client/tev/tev_bridge.h"

namespace helio::cli {

// One view's picture.
struct PlayedView {
  FrameAssembler picture;
  std::vector<std::string> unsampled, notices;  // FrameBegin's
  std::optional<heliograph::v1::FrameEnd> end;  // none: the stream was lost, or the play cancelled, before its end
  double first_tile_seconds = 0;                // from sending the view to its first tile here; 0: none came
};

// Options under which the terminal tells that a daemon restarts.
ReattachOptions reattach_options(double patience_s, Terminal& terminal);

class MovePlayer {
 public:
  // Opens the stream of a session that exists. `tev` is shown the film; null: nothing is.
  // patience_s: as ReattachOptions.
  MovePlayer(RenderClient& client, const std::string& session_id, const heliograph::v1::TileFormat& format,
             const heliograph::v1::Budget& budget, double patience_s, Terminal& terminal, TevBridge* tev);
  ~MovePlayer();

  // Sends the view and its budget. The view before must have been awaited.
  Status send(const PathView& view, double time_s);
  // Blocks until the view that was sent is done, the stream is over or cancel() was called. On error `view` holds what
  // there is.
  Status await(PlayedView& view);
  // Ends the stream and its session.
  Status close();

  // From any thread: await() returns with ErrorCode::cancelled.
  void cancel();

 private:
  FrameCallbacks callbacks();
  void fail(const Error& error);

  Terminal& terminal_;
  TevBridge* const tev_;
  const heliograph::v1::Budget default_budget_;
  heliograph::v1::Budget budget_;  // in force
  std::uint64_t view_id_ = 0;
  std::uint64_t preview_frame_ = 0;  // the newest frame that is a preview

  std::mutex mutex_;
  std::vector<std::string> notices_;  // of the server, that await() has yet to show
  std::condition_variable changed_;
  PlayedView current_;
  double sent_s_ = 0;
  bool done_ = true;
  std::optional<Error> failure_;

  std::unique_ptr<SessionStream> stream_;  // last: its callbacks use what is above
};

}  // namespace helio::cli
