// The renderer speaks only through this interface: the daemon, a test and a still-image job are three small listeners.
//
// A frame is one view's picture from its first sample until a budget ends it, a newer revision supersedes it or it is
// cancelled. On the way each of its tiles is published several times (passes), each time with more samples.
// Calls come from render workers, one at a time per render loop, in order: begun, tiles..., ended. They must return
// soon: a worker that waits in a sink renders for nobody. A call that throws, as where memory is out, fails its frame:
// the next call is that of its end, with the reason `failed`. An end that throws is told again, eight times at most.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

struct FrameTag {
  std::uint64_t revision = 0;  // of the session: raised by every change of view, settings, budget or region
  std::uint64_t view_id = 0;
  std::uint64_t frame = 0;  // counts frames of the render loop

  bool same_frame(const FrameTag& other) const { return revision == other.revision && frame == other.frame; }
};

struct FrameBegin {
  FrameTag tag;
  RenderSettings settings;
  PixelRect region;  // rendered part of the film
  CameraPose camera;  // fitted()
  double exposure = 0;                     // View::exposure
  std::optional<Gaze> gaze;                // View::gaze when the frame began
  // now_s() when what changed the picture was accepted: a view, settings, a scene. 0: the same picture goes on, or is
  // shown again.
  double changed_s = 0;
  std::weak_ptr<const RenderScene> scene;  // a sink keeps no scene alive; null: not a scene's
  std::vector<std::string> unsampled;      // unsampled_light() of the two
  std::string notice;                      // aspect_notice() of the view
  bool preview = false;                    // a frame of its own that shows a preview; its tiles have `display` alone
};

struct FrameTile {
  FrameTag tag;
  std::uint32_t pass = 0;               // publication round within the frame
  bool final = false;                   // last publication of this tile in the frame
  // Both halves; where counts differ the picture's mean, rounded, and 1 while others are still being reprojected.
  std::uint32_t samples_per_pixel = 0;
  ResolvedTile pixels;
  bool preview = false;  // FrameBegin::preview: final, of pass 0 and without samples
};

// preview: it is whole.
enum class FrameEndReason { samples, time, error, superseded, cancelled, failed, preview };
const char* to_string(FrameEndReason reason);

struct PassTime {
  std::string pass;    // "integrate", "measure" (error estimate), "resolve", "publish" (time in the sink),
                       // "allocate" (modes with adaptive counts), "choose" (integrator pt+bdpt), "trace_lights"
                       // (light vertices), "reproject", "review" (modes that reuse pictures), "display" (where
                       // tiles have that layer), "checkpoint", "restore" (pictures stored and put back), "preview"
  double seconds = 0;  // of processor time, summed over workers
};

struct FrameProgress {
  FrameTag tag;
  double seconds = 0;                   // wall time since the frame began
  std::uint32_t samples_per_pixel = 0;  // completed everywhere in the region, both halves; or the mean
  double samples_per_second = 0;        // pixel samples over the frame's wall time
  // Modes that reuse pictures: share of the picture's effective samples that came from earlier ones, [0, 1], and the
  // rays that told what may, whether or not something did.
  double reuse_share = 0;
  std::uint64_t verification_rays = 0;
  TraceStats trace;                     // since the film was cleared: earlier frames of a kept film included
  FilmError error;                      // newest estimate
  double budget_used = 0;               // [0, 1]: the largest share among the budgets given; 0 when unlimited
};

struct FrameEnd {
  FrameTag tag;
  FrameEndReason reason = FrameEndReason::samples;
  std::string message;            // failed: why
  std::string notice;             // filled in by who passes it on: what is to be said of how the picture was made
  FrameProgress progress;         // at the end
  double first_tile_seconds = 0;  // view accepted -> first tile handed to the sink; 0: none was
  std::vector<PassTime> passes;
};

class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void frame_begun(const FrameBegin& begin) = 0;
  virtual void tile_ready(FrameTile tile) = 0;
  virtual void frame_ended(const FrameEnd& end) = 0;

  // How many tiles wait behind the sink (backlog); the scheduler publishes less often when it grows, and only the final
  // state once a whole picture waits. Called at any time, from any worker, also during the calls above.
  virtual std::size_t backlog() const { return 0; }
};

}  // namespace helio
