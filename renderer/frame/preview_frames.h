// A render loop's frames that are previews: when they begin, what they keep from one to the next, and their pieces. The
// film's pipeline, grid and picture take no part in them.
//
// Not thread safe: the loop's lock guards all but the running of pieces.
#pragma once

#include <memory>
#include <utility>

#include "renderer/frame/frame_pipeline.h"
#include "renderer/frame/preview_clock.h"
#include "renderer/frame/render_settings.h"
#include "renderer/frame/sink_queue.h"
#include "renderer/frame/stages/preview.h"

namespace helio {

// A film of which every pixel of the region is of one view, and to which nobody writes.
struct RestingFilm {
  const Film& film;
  const DisplayLayer* display = nullptr;  // null: has none
  const RenderScene* scene = nullptr;
  CameraPose camera;  // fitted()
  PixelRect region;
};

class PreviewFrames {
 public:
  PreviewFrames(int threads, double piece_seconds, int tile_size)
      : pipeline(threads, piece_seconds), threads_(threads), piece_seconds_(piece_seconds), tile_size_(tile_size) {}

  PreviewClock clock;
  FramePipeline pipeline;
  std::shared_ptr<FrameRecord> next_record;  // of the preview that is due

  // Whether a history does for previews of these settings; any does where none are asked for.
  static bool suits(const std::shared_ptr<PreviewHistory>& history, const RenderSettings& settings);
  // The same of the newest history.
  bool suit(const RenderSettings& settings) const { return suits(next_history_ ? next_history_ : history_, settings); }

  // From the next preview on. fresh: its history; null: the newest one. A rate of 0 lets go of all. Returns what is of
  // no use any more.
  std::pair<std::shared_ptr<PreviewHistory>, std::shared_ptr<PreviewHistory>> set(
      double rate, std::shared_ptr<PreviewHistory> fresh) noexcept;
  // The next preview looks nothing up.
  void forget_history() { forget_due_ = true; }

  // Begins the frame's pieces. rest: taken over first if the newest preview is of its view; null: there is none. Returns
  // what is of no use any more. What throws calls for spoil(). Precondition: the clock is on, no piece is in flight.
  std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>> begin(
      const FrameRecord& frame, std::shared_ptr<const RenderScene> scene, std::shared_ptr<const CancelToken> cancel,
      const Film& film, const RestingFilm* rest);
  void finish(const Piece& piece, bool done, double seconds, double now_s) {
    if (!broken_) pipeline.finish(piece, done, seconds, now_s);
  }
  // All pieces have ended.
  void note_end();
  // Something was thrown while a piece was handed out or taken back.
  void spoil() { broken_ = forget_due_ = true; }

  // Of the newest frame; null: released.
  const std::shared_ptr<PreviewStage>& stage() const { return stage_; }
  std::shared_ptr<PreviewStage> release_stage() noexcept {
    pipeline.release_stages();
    return std::exchange(stage_, nullptr);
  }

  std::size_t bytes() const;

 private:
  int threads_;
  double piece_seconds_;
  int tile_size_;
  std::shared_ptr<PreviewHistory> history_, next_history_;  // the second takes over with the next preview
  std::shared_ptr<PreviewStage> stage_;
  double output_s_ = 0;      // from the last sweep to the last tile, wall time, running mean; 0: not known yet
  bool forget_due_ = false;  // what the history knows is of no use
  bool broken_ = false;      // the pipeline is in no defined state, and must not be told of pieces that end
};

}  // namespace helio
