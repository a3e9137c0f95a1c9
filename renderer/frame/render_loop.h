// One session's resident state (film, view, settings, revision) and the loop that turns it into frames.
//
// RenderEngine owns the machine: one oneTBB arena whose workers pull pieces of at most about 5 ms from a weighted-fair
// queue over all render loops (interactive before jobs; equal ranks by time used). RenderLoop is what a session or a
// job holds: it plans (FrameScheduler), hands out pieces (FramePipeline) and speaks through its FrameSink.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/base/result.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/render_scene.h"

namespace helio {

enum class RenderRank { interactive, job };

class RenderEngine {
 public:
  explicit RenderEngine(int threads);  // 0: one per core
  ~RenderEngine();                     // precondition: every RenderLoop is gone
  RenderEngine(const RenderEngine&) = delete;
  RenderEngine& operator=(const RenderEngine&) = delete;

  int threads() const;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// Thread safe. No member blocks on rendering, except the destructor, which cancels and waits for the pieces in flight
// (at most about 5 ms each); the sink is not called after it returns.
class RenderLoop {
 public:
  RenderLoop(RenderEngine& engine, std::shared_ptr<const RenderScene> scene, const RenderSettings& settings,
             const Budget& budget, RenderRank rank, std::shared_ptr<FrameSink> sink);
  ~RenderLoop();
  RenderLoop(const RenderLoop&) = delete;
  RenderLoop& operator=(const RenderLoop&) = delete;

  // Several changes at once make one revision. Absent fields stay as they are. Values must have been validated.
  struct Update {
    std::optional<View> view;
    std::optional<RenderSettings> settings;
    std::optional<Budget> budget;
  };
  // Applies the update, supersedes the frame in flight and returns the new revision. A changed budget alone lets the
  // picture go on: the film is kept. An identical view keeps the film as well. Rendering starts with the first view.
  std::uint64_t update(const Update& update);

  // Ends the frame in flight with FrameEndReason::cancelled; nothing is rendered until the next update.
  void cancel();

  std::uint64_t revision() const;
  FrameProgress progress() const;       // of the frame in flight, or of the last one
  double used_seconds() const;          // worker time charged to this loop
  std::size_t memory_bytes() const;     // film and scratch

  // Publishes every tile of the newest state again (a client re-attached). Does nothing without samples.
  void republish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio
