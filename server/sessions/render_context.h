// What a session and a job have in common: a scene, a render loop, and the way of its frames to whoever listens.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "renderer/base/result.h"
#include "renderer/frame/render_loop.h"
#include "server/base/memory_account.h"
#include "server/base/reaper.h"
#include "server/base/timer_queue.h"
#include "server/scenes/scene_registry.h"
#include "server/sessions/device_rendering.h"
#include "server/stream/frame_publisher.h"

namespace helio {

// Bytes of a film of this size, and of what its pictures need besides: light vertices.
std::uint64_t film_bytes(const RenderSettings& settings);
std::uint64_t scratch_bytes(const RenderSettings& settings);
// What previews keep; 0: none are asked for.
std::uint64_t preview_bytes(const RenderSettings& settings);
// The display layer, of tiles with these channels; 0: they have none.
std::uint64_t display_bytes(const RenderSettings& settings, unsigned channels);

// Freed by the reaper, whoever lets go of it last: its film may have gigabytes.
class RenderContext : public std::enable_shared_from_this<RenderContext>, private Reaper::Item {
 public:
  struct Resources {
    RenderEngine& engine;
    MemoryAccount& memory;
    TimerQueue& timers;
    Reaper& reaper;
    std::shared_ptr<const OidnLibrary> oidn = nullptr;  // null: there is none, and no channels may ask for it
    RenderDevices* devices = nullptr;                   // null: there is the CPU alone
    StreamCounters* counters = nullptr;                 // null: nothing is counted
    std::string owner = {};                             // as RenderLoopOptions
  };

  // Reserves and allocates the film, which for gigabytes takes seconds. `sink`: where frames go in place of a stream;
  // null: to publisher(). checkpoints: without `count`. resource_exhausted: max_memory.
  static Result<std::shared_ptr<RenderContext>> create(const Resources& resources, SceneLease scene,
                                                       const RenderSettings& settings, const Budget& budget,
                                                       RenderRank rank, FramePublisher::Tiles tiles, unsigned channels,
                                                       std::shared_ptr<FrameSink> sink = nullptr,
                                                       std::optional<CheckpointOptions> checkpoints = {});

  // That is rendered; valid until the next call of switch_scene().
  const LoadedScene& scene() const;
  // What is to be said of a device that has failed; empty: none has.
  std::string device_failure() const { return device_->failure(); }
  // Gives back what place() has placed: no later frame is rendered on a device.
  void release_device();
  // Puts a scene that is about to be rendered on the settings' device, if it is not there. Takes as long as a build;
  // errors as RenderDevices::place().
  Status place(const RenderDevice& device, const std::shared_ptr<const RenderScene>& scene);
  // Makes the update, and renders this scene from now on. The new revision. What RenderLoop::update() throws leaves the
  // scene as it is.
  std::uint64_t switch_scene(SceneLease scene, RenderLoop::Update update);
  RenderLoop& loop() { return *loop_; }
  const RenderLoop& loop() const { return *loop_; }
  FramePublisher& publisher() { return *publisher_; }
  const FramePublisher& publisher() const { return *publisher_; }

  // Puts into `update` what these settings and channels need of memory that is not there, reserved and allocated beside
  // the present film. Takes as long as create(); one call at a time, and its update comes before the next call.
  Status prepare(const RenderSettings& settings, unsigned channels, RenderLoop::Update& update);
  // The same for other channels alone, with the newest settings.
  Status prepare_display(const RenderSettings& settings, unsigned channels, RenderLoop::Update& update);
  // Memory for the queue of a listener, two frames, with room made for it: not to be called with a session's lock.
  // Thread safe. resource_exhausted: max_memory.
  Result<Reservation> reserve_queue(const RenderSettings& settings, const TileFormat& format) const;
  // Keeps it in place of the one before. If these are not the settings and format that it was reserved for, so much is
  // reserved instead, without making room.
  Status keep_queue(Result<Reservation> memory, const RenderSettings& settings, const TileFormat& format);
  void release_queue() { queue_memory_.release(); }

  // A copy of the picture in hand, of these settings and this budget, which goes on for it to the next boundary between
  // two plans (a sample of every pixel at most) and then rests. Memory is reserved without making room.
  // failed_precondition: such pictures have no copies; resource_exhausted: max_memory; unavailable: it was not made by
  // `deadline_s` (now_s() clock), or within seconds.
  Result<std::shared_ptr<const PictureCheckpoint>> copy_picture(const RenderSettings& settings, const Budget& budget,
                                                                double deadline_s);

  // Puts the progress into the stream's queue about four times a second, until the stream ends or is replaced.
  void report_progress(const std::shared_ptr<OutboundStream>& stream);

 private:
  // The scene that is rendered and the one before, of which a frame's end may still be told.
  struct Scenes {
    std::mutex mutex;
    SceneLease current;
    std::weak_ptr<const LoadedScene> before;
  };

  explicit RenderContext(const Resources& resources) : resources_(resources) {}
  ~RenderContext() override = default;
  void give_to_reaper() noexcept;
  void report_progress_later(std::weak_ptr<OutboundStream> stream, double seconds_told);

  Resources resources_;
  const std::shared_ptr<Scenes> scenes_ = std::make_shared<Scenes>();  // with the maker of replay tokens
  std::weak_ptr<const Reservation> scratch_;  // the newest; the loop keeps it
  Reservation queue_memory_;
  std::shared_ptr<FramePublisher> publisher_;
  std::shared_ptr<DeviceRendering> device_;
  std::unique_ptr<RenderLoop> loop_;  // after what its sink uses
};

}  // namespace helio
