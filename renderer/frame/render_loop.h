// One session's resident state (film, view, settings, revision) and the loop that turns it into frames.
//
// RenderEngine owns the machine: one oneTBB arena whose workers pull pieces of at most about 5 ms from a weighted-fair
// queue over all render loops (interactive ones and jobs share 8 to 1, those of equal rank evenly). RenderLoop is what
// a session or a job holds: it plans (FrameScheduler), hands out pieces (FramePipeline) and speaks through its
// FrameSink.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "renderer/base/result.h"
#include "renderer/frame/checkpoint/checkpoint_maker.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

// While both have work, interactive loops together have eight ninths of the machine, jobs together one.
enum class RenderRank { interactive, job };

class Film;

// A cleared film for pictures of these settings; seconds for gigabytes. `count` is whatever the caller counts its
// memory by: it is released once the film has been freed. Throws std::bad_alloc.
std::shared_ptr<Film> make_film(const RenderSettings& settings, std::shared_ptr<const void> count = nullptr);

class PreviewHistory;

// What previews of these settings keep from one to the next (preview/preview_history.h); null where none are asked for.
// `count` as of make_film(). Throws std::bad_alloc.
std::shared_ptr<PreviewHistory> make_preview_history(const RenderSettings& settings,
                                                     std::shared_ptr<const void> count = nullptr);

class DisplayLayer;
class OidnLibrary;

// Of these settings, for tiles with these channels (film/display/display_layer.h); null where they have no such layer.
// By `oidn` where the channels have kDisplayByOidn and it is not null, else by our own filter. `count` as of
// make_film(). Throws std::bad_alloc.
std::shared_ptr<DisplayLayer> make_display_layer(const RenderSettings& settings, unsigned channels,
                                                 const std::shared_ptr<const OidnLibrary>& oidn,
                                                 std::shared_ptr<const void> count = nullptr);

// What an engine's workers have done for all loops, those that are gone included.
struct RenderTotals {
  std::uint64_t samples = 0;          // of pixels, that went into a film; not what was restored or carried
  std::uint64_t rays = 0;             // TraceStats::rays, those of previews and of samples that were thrown away included
  std::uint64_t invalid_samples = 0;  // TraceStats::invalid()
};

class RenderEngine {
 public:
  explicit RenderEngine(int threads);  // 0: one per core
  ~RenderEngine();                     // precondition: every RenderLoop is gone
  RenderEngine(const RenderEngine&) = delete;
  RenderEngine& operator=(const RenderEngine&) = delete;

  int threads() const;
  double used_seconds() const;          // processor time of all loops, those that are gone included
  RenderTotals totals() const;
  std::vector<int> thread_ids() const;  // the system's, of the workers that have begun

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

struct RenderLoopOptions {
  int tile_size = 128;  // pixels, aligned to the film, rounded up to a multiple of kPathGroupSize; >= 1
  unsigned channels = kResolveVariance | kResolveSamples;  // ResolveChannels of the tiles, besides radiance
  std::shared_ptr<const OidnLibrary> oidn;  // for kDisplayByOidn; null: such channels have our own filter's layer
  // Show the picture while it is made: after 1, 2, 4, ... samples and at most about every publish_interval_s. False:
  // its final state alone. Absent: yes for interactive loops, no for jobs.
  std::optional<bool> publish_passes;
  double publish_interval_s = 0.25;
  double bytes_per_pixel = 0;  // of an encoded tile, for Budget::bytes_per_second; 0: two bytes per plane
  // What traces a scene; null: path_tracer(). It may be asked for the scenes of later updates.
  std::function<IntegrateFunction(std::shared_ptr<const RenderScene>)> make_tracer;
  // Makes checkpoints of pictures whose settings have some (can_checkpoint()). Absent: none.
  std::optional<CheckpointOptions> checkpoints;
  std::string owner;  // owners have equal shares of what loops of this rank get; "" is one owner, too
  bool keep_light_vertices = true;  // from view to view (stages/trace_lights.h); false: for benches
  // As in RenderLoop::Update.
  std::shared_ptr<Film> film;
  std::shared_ptr<PreviewHistory> previews;
  std::shared_ptr<DisplayLayer> display;
  std::shared_ptr<const void> scratch_count;
};

// Thread safe. No member blocks on rendering, except the destructor, which cancels and waits for the pieces in flight
// (at most about 5 ms each) and must not be called from the sink; the sink is not called after it returns, not even for
// the end of the frame in flight. Without a film that suits, the constructor and an update that changes the film's size
// allocate one in the calling thread: std::bad_alloc leaves the loop as it was. What workers or the sink throw ends the
// frame in flight as failed, with the reason; the next update begins anew.
class RenderLoop {
 public:
  RenderLoop(RenderEngine& engine, std::shared_ptr<const RenderScene> scene, const RenderSettings& settings,
             const Budget& budget, RenderRank rank, std::shared_ptr<FrameSink> sink,
             const RenderLoopOptions& options = {});
  // With another source of radiance than a scene, whose pictures are not reused.
  RenderLoop(RenderEngine& engine, IntegrateFunction integrate, const RenderSettings& settings, const Budget& budget,
             RenderRank rank, std::shared_ptr<FrameSink> sink, const RenderLoopOptions& options = {});
  ~RenderLoop();
  RenderLoop(const RenderLoop&) = delete;
  RenderLoop& operator=(const RenderLoop&) = delete;

  // Several changes at once make one revision. Absent fields stay as they are. Values must have been validated.
  struct Update {
    std::optional<View> view;
    std::optional<RenderSettings> settings;
    std::optional<Budget> budget;
    std::optional<unsigned> channels;          // RenderLoopOptions::channels
    std::shared_ptr<const RenderScene> scene;  // null: unchanged. Modes that reuse pictures keep of the
                                               // film what an edit has left true; another load begins anew
    std::shared_ptr<Film> film;                // by make_film(), for these settings; null, or no longer the right
                                               // kind: the loop makes one itself, if it needs another
    std::shared_ptr<PreviewHistory> previews;  // by make_preview_history(); likewise
    std::shared_ptr<DisplayLayer> display;     // by make_display_layer(); likewise
    // The picture of the view begins with it: it must suit the settings and the view, those of the update or those
    // before (PictureCheckpoint::suits()). Let go of once it is in the film. Null: no picture is taken up.
    std::shared_ptr<const PictureCheckpoint> resume;
    // Counts what these settings take besides the film; released once that has been freed. Null: the one before stays.
    std::shared_ptr<const void> scratch_count;
    bool begin = true;  // false: no frame begins before the next update
  };
  // True when pictures of these settings need no other film than the newest one.
  bool film_suits(const RenderSettings& settings) const;
  // The same of what previews keep: true, too, when the settings ask for none.
  bool previews_suit(const RenderSettings& settings) const;
  // The same of the display layer, for tiles with these channels.
  bool display_suits(const RenderSettings& settings, unsigned channels) const;
  // Applies the update, supersedes the frame in flight and returns the new revision; 0, and nothing has changed, where
  // Update::resume does not suit. A changed budget alone lets the
  // picture go on: the film is kept. An identical view keeps the film as well (its id, exposure and channels may
  // differ). Rendering starts with the first view.
  //
  // With previews (RenderSettings::preview) a preview in flight is not superseded, and its tiles are not dropped: it
  // comes to its end, then one of the newest view begins, and the film's frame once the camera rests (PreviewClock). A
  // preview that fails says so and is left out.
  //
  // Tiles of older revisions that wait are dropped. The revision is checked right before each call of the sink, so the
  // only old tile that the sink may still see after update() has returned is one whose call had begun; the newer
  // frame_begun comes after it, and no older tile after that.
  std::uint64_t update(const Update& update);

  // Of the newest view, without a revision: from now on samples go where it asks for, what the film has stays, and a
  // frame that its budget has ended goes on. Without a view, and where the settings have no use for a gaze, nothing
  // else happens.
  void move_gaze(const std::optional<Gaze>& gaze);

  // Of the budget, from now on; the frame in flight goes on, and so does the revision.
  void set_rate(std::optional<double> bytes_per_second);

  // Ends the frame in flight with FrameEndReason::cancelled, drops tiles that wait; nothing is rendered until the next
  // update. The revision stays.
  void cancel();

  std::uint64_t revision() const;
  FrameProgress progress() const;    // of the frame in flight, or of the last one; counts as of its last whole plan
  double used_seconds() const;       // workers' processor time charged to this loop
  // No other loop of the engine is rendered for so long, or until release_others(), or until this one is gone: for
  // measurements. The newest call of any loop counts.
  void hold_others(double seconds);
  void release_others();
  std::size_t memory_bytes() const;  // film and scratch
  std::uint64_t invalid_samples() const;  // over all of the loop's life, whatever became of the film that they missed

  // As RenderLoopOptions::checkpoints, of a loop that was made without; their memory is allocated in the calling thread
  // (std::bad_alloc). A loop that makes some already stays as it is.
  void begin_checkpoints(CheckpointOptions options);
  // Makes a checkpoint of the picture in flight at the next boundary between two plans, a second or so away (one sample
  // of every pixel, where that takes longer), and not before the newest one is free (CheckpointOptions). Where the
  // frame ends before, of the next frame.
  void checkpoint_soon();
  // Makes the memory that CheckpointOptions::prepare_later has put off, tens of milliseconds for a film of 640x360;
  // nothing if it is there. Throws std::bad_alloc.
  void prepare_checkpoints();

  // Publishes every tile of the newest state again (a client re-attached): within the frame in flight, else as a frame
  // of its own (begun, final tiles, ended with the last reason). Does nothing without samples.
  void republish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
