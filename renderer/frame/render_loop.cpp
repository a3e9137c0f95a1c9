#include "renderer/frame/render_loop.h"

#include <algorithm>
#include <bit>
#include <mutex>
#include <numeric>
#include <utility>

#include "renderer/base/cancel.h"
#include "renderer/base/clock.h"
#include "renderer/base/hash.h"
#include "renderer/film/core/film_extension.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/frame/failure_reason.h"
#include "renderer/frame/frame_pipeline.h"
#include "renderer/frame/frame_scheduler.h"
#include "renderer/frame/preview_frames.h"
#include "renderer/frame/stages/allocate.h"
#include "renderer/frame/stages/make_stage.h"
#include "renderer/frame/stages/temporal_reprojection.h"
#include "renderer/frame/render_engine.h"
#include "renderer/frame/sink_queue.h"
#include "renderer/frame/thread_clock.h"
#include "renderer/trace/scene/scene_difference.h"
#include "renderer/trace/selection/unsampled_light.h"

namespace helio {

namespace {

IntegrateFunction make_tracer(std::shared_ptr<const RenderScene> scene, const RenderLoopOptions& options) {
  return options.make_tracer ? options.make_tracer(std::move(scene)) : path_tracer(std::move(scene));
}

// Resolved tiles that may wait for the sink: a few for each worker, so that resolving and handing over overlap.
std::size_t tiles_that_may_wait(int threads) {
  return 2 + 2 * std::size_t(threads);
}

int plane_count(unsigned channels) {
  std::size_t count = 0;
  for (const Channel& channel : channel_table()) {
    if (channel.in(channels)) count += channel.planes.size();
  }
  return int(count);
}

// A sink that throws when it is told of an end is told again, so many times in all.
constexpr int kMostEndTries = 8;

// Samples of a picture that draws on others must not repeat theirs.
std::uint64_t picture_seed(std::uint64_t seed, std::uint64_t generation) {
  return generation == 0 ? seed : hash64(seed ^ hash64(generation));
}

void blend(double& mean, double value) {
  if (value > 0) mean = mean > 0 ? mean + 0.5 * (value - mean) : value;
}

bool suits(const Film& film, const RenderSettings& settings) {
  return film.width() == settings.width && film.height() == settings.height && film.state() == film_state(settings);
}

bool suits(const std::shared_ptr<DisplayLayer>& layer, const RenderSettings& settings, unsigned channels,
           const std::shared_ptr<const OidnLibrary>& oidn) {
  return !(channels & kResolveDisplay) ||
         (layer && layer->width() == settings.width && layer->height() == settings.height &&
          layer->by_oidn() == ((channels & kDisplayByOidn) && oidn));
}

// Whether paths of both find the same light, so that previews may go on with what they know.
bool same_light(const RenderSettings& a, const RenderSettings& b) {
  return a.max_segments == b.max_segments && a.technique == b.technique;
}

// The first four of every frame of the film, the others where there was something to do.
std::vector<PassTime> pass_times(const FrameRecord& record) {
  const auto seconds = [&](StageId id) { return record.stage_seconds[std::size_t(id)]; };
  std::vector<PassTime> times;
  if (record.begin.preview) {
    for (const StageId id : {StageId::preview, StageId::resolve}) times.push_back({to_string(id), seconds(id)});
    times.push_back({"publish", record.publish_seconds});
    return times;
  }
  for (const StageId id : {StageId::integrate, StageId::measure, StageId::resolve})
    times.push_back({to_string(id), seconds(id)});
  times.push_back({"publish", record.publish_seconds});
  for (const StageId id : {StageId::reproject, StageId::choose, StageId::trace_lights, StageId::review,
                           StageId::allocate, StageId::display, StageId::checkpoint, StageId::restore}) {
    if (seconds(id) > 0) times.push_back({to_string(id), seconds(id)});
  }
  return times;
}

// What takes long to free, and so is freed after the lock: in reverse order, what counts others' memory at last.
class Retired {
 public:
  Retired() = default;
  Retired(const Retired&) = delete;
  ~Retired() {
    while (!kept_.empty()) kept_.pop_back();
  }
  void add(std::shared_ptr<const void> what) {
    if (what) kept_.push_back(std::move(what));
  }

 private:
  std::vector<std::shared_ptr<const void>> kept_;
};

// Shared, with `count` released after it has been freed.
template <class T>
std::shared_ptr<T> counted(std::shared_ptr<const void> count, T&& value) {
  struct Counted {
    std::shared_ptr<const void> count;
    T value;
  };
  auto both = std::make_shared<Counted>(Counted{std::move(count), std::move(value)});
  return {both, &both->value};
}

// Of another picture that follows this one: what is known of the machine.
FrameState with_costs_of(const FrameState& before) {
  FrameState state;
  state.sample_seconds = before.sample_seconds;
  state.measure_seconds = before.measure_seconds;
  state.display_seconds = before.display_seconds;
  state.publish_seconds = before.publish_seconds;
  return state;
}

}  // namespace

// Everything below `mutex` is guarded by it. It is never held while the sink, the integrate function or the film's
// pixels are touched; the film is written and read by pieces, and replaced or given to another picture only while none
// is in flight.
struct RenderLoop::Impl final : PieceSource {
  Impl(RenderEngine::Impl& engine, IntegrateFunction integrate, std::shared_ptr<const RenderScene> scene,
       const RenderSettings& settings, const Budget& budget, RenderRank rank, std::shared_ptr<FrameSink> sink,
       const RenderLoopOptions& options);
  ~Impl() override;

  bool run_piece() override;
  bool failed(std::string reason) noexcept override;

  std::uint64_t update(const Update& update);
  void set_rate(std::optional<double> bytes_per_second);
  void move_gaze(const std::optional<Gaze>& gaze);
  void cancel();
  void republish();
  void prepare_checkpoints();
  void begin_checkpoints(CheckpointOptions checkpoint_options);
  void checkpoint_soon();
  FrameProgress progress() const;
  std::size_t memory_bytes() const;

  // All of these: `mutex` is held.
  PublishPolicy publish_policy() const { return {passes, options.publish_interval_s}; }
  // Of the picture in hand.
  RenderSettings frame_settings() const {
    RenderSettings own = settings;
    own.seed = picture_seed(settings.seed, history.generation);
    return own;
  }
  void note_gaze();
  bool room() const { return waiting.size() < tiles_that_may_wait(engine.threads()); }
  bool has_work();
  bool deliver_waiting(std::unique_lock<std::mutex>& lock) noexcept;
  void prepare(SinkEvent& event, double now);
  void sink_failed(const std::shared_ptr<FrameRecord>& record, SinkEventSlot& slot, std::string reason) noexcept;
  void open_frame(std::shared_ptr<FrameRecord> record) noexcept;
  bool previewing() const { return frame && frame->begin.preview; }
  // A preview in flight comes to its end before anything else begins.
  bool next_due() const { return next != Next::nothing && !previewing(); }
  PreviewClock::Decision what_next() const {
    return next == Next::show_again ? PreviewClock::Decision() : previews.clock.decide();
  }
  FramePipeline& pipeline_of(const FrameRecord& record) { return record.begin.preview ? previews.pipeline : pipeline; }
  std::optional<RestingFilm> resting_film() const;
  void begin_preview(Retired& retired);
  void begin_frame(Retired& retired);
  void begin_picture(bool reuse, Retired& retired);
  void advance(std::size_t backlog);
  double mean_of_tiles() const;
  StageContext stage_context();
  void note_finished_plan(double now);
  // These allocate nothing.
  void end_frame(FrameEndReason reason, std::string message) noexcept;
  void abandon_frame(FrameEndReason reason) noexcept;
  void fail_frame(std::string reason) noexcept;
  void give_up(std::string reason) noexcept;
  FrameProgress progress_at(double now) const;
  bool anything_to_show() const;
  bool display_due() const;
  bool checkpoint_due(double now) const;
  std::optional<Piece> take(std::size_t backlog, Retired& retired);
  void run_piece(std::unique_lock<std::mutex>& lock, std::size_t backlog, Retired& retired);

  RenderEngine::Impl& engine;
  const std::shared_ptr<FrameSink> sink;
  RenderLoopOptions options;  // without the film, which has a life of its own
  const bool passes;  // PublishPolicy::passes
  FairQueue::Id id = 0;

  mutable std::mutex mutex;
  // Before all that they count, and so released after it. The second takes over with the next frame; null: none does.
  std::shared_ptr<const void> scratch_count, next_scratch_count;
  // What is asked for.
  std::shared_ptr<const IntegrateFunction> integrate;
  std::shared_ptr<const RenderScene> scene;  // that it traces; null: another source of radiance
  RenderSettings settings;
  Budget budget;
  unsigned channels;
  std::optional<View> view;
  std::uint64_t revision = 0;
  double accepted_s = 0, view_accepted_s = 0;
  // What has to happen before pieces are handed out again; carried out once none is in flight.
  enum class Next { nothing, render, show_again } next = Next::nothing;
  bool another_picture = false;  // the film's samples are of no use to it as they are
  bool another_kind = false;     // and to no later picture
  bool another_grid = true;
  std::shared_ptr<Film> next_film;  // null: the same film
  std::shared_ptr<const PictureCheckpoint> next_resume;  // that the next picture begins with; null: nothing
  std::shared_ptr<FrameRecord> next_record;  // of the frame that is asked for; null: none is

  // What is.
  std::shared_ptr<Film> film;
  PictureHistory history;                     // of the film, in modes that reuse pictures
  TechniqueHistory techniques;                // what pt+bdpt has probed, in modes that reuse pictures
  std::shared_ptr<LightVertexSource> lights;  // null: the integrator draws on none
  PictureState picture;
  FramePipeline pipeline;
  // Of the picture that is in the film, or comes to be there.
  std::weak_ptr<const RenderScene> film_scene;
  CameraPose film_camera;
  std::shared_ptr<DisplayLayer> display, next_display;  // the second takes over with the next frame
  PreviewFrames previews;
  std::optional<CheckpointMaker> checkpoints;  // absent: none are made
  int running = 0;      // pieces
  bool broken = false;  // the pipeline is in no defined state, and must not be told of pieces that end
  FrameScheduler scheduler;
  std::uint64_t invalid_samples = 0;   // since the loop was made
  std::uint64_t frame_samples = 0;     // pixel samples since the frame began
  bool planned = false;                // the pipeline carries out a plan of this frame
  std::uint64_t planned_gaze_moves = 0;  // FrameState::gaze_moves when that was made
  bool half_allocated = false;         // a plan that was to give pixels their counts was cut short
  std::shared_ptr<FrameRecord> frame;  // in flight; null: none
  std::shared_ptr<CancelToken> token = std::make_shared<CancelToken>();
  std::uint64_t frames = 0;
  FrameProgress last_progress;
  FrameEndReason last_reason = FrameEndReason::cancelled;

  SinkQueue waiting;
  bool delivering = false;
};

RenderLoop::Impl::Impl(RenderEngine::Impl& engine_, IntegrateFunction integrate_,
                       std::shared_ptr<const RenderScene> scene_, const RenderSettings& settings_,
                       const Budget& budget_, RenderRank rank, std::shared_ptr<FrameSink> sink_,
                       const RenderLoopOptions& options_)
    : engine(engine_),
      sink(std::move(sink_)),
      options(options_),
      passes(options_.publish_passes.value_or(rank == RenderRank::interactive)),
      scratch_count(options_.scratch_count),
      integrate(std::make_shared<const IntegrateFunction>(std::move(integrate_))),
      scene(std::move(scene_)),
      settings(settings_),
      budget(budget_),
      channels(options_.channels),
      film(options_.film && suits(*options_.film, settings_) ? options_.film : make_film(settings_)),
      pipeline(engine_.threads(), kPieceSeconds),
      previews(engine_.threads(), kPieceSeconds, options_.tile_size),
      scheduler(budget_, publish_policy(), allocation_settings(settings_)) {
  options.film.reset();
  options.scratch_count.reset();
  if (scene && settings.preview.rate > 0) {
    const bool suit = PreviewFrames::suits(options.previews, settings);
    previews.set(settings.preview.rate, suit ? options.previews : make_preview_history(settings));
  }
  options.previews.reset();
  display = suits(options.display, settings, channels, options.oidn)
                ? options.display
                : make_display_layer(settings, channels, options.oidn);
  options.display.reset();
  if (options.checkpoints) checkpoints.emplace(std::move(*options.checkpoints), settings);
  options.checkpoints.reset();
  id = engine.add(*this, rank, options.owner);
}

RenderLoop::Impl::~Impl() {
  {
    const std::lock_guard lock(mutex);
    token->cancel();
    pipeline.stop();
    previews.pipeline.stop();
    waiting.clear();
    frame.reset();
    next = Next::nothing;
  }
  engine.remove(id);
}

// Where the next frame is to begin later, the engine is told when.
bool RenderLoop::Impl::has_work() {
  if (!waiting.empty() && !delivering) return true;
  if (next_due()) {
    if (running > 0) return false;
    const double at_s = what_next().at_s;
    if (at_s <= now_s()) return true;
    engine.wake_at(id, at_s);
    return false;
  }
  if (!frame) return false;
  const FramePipeline& own = pipeline_of(*frame);
  return (running == 0 && own.over()) || own.may_take(room());
}

std::uint64_t RenderLoop::Impl::update(const Update& update) {
  std::shared_ptr<const IntegrateFunction> tracer;
  if (update.scene) tracer = std::make_shared<const IntegrateFunction>(make_tracer(update.scene, options));
  // Freed after the lock.
  std::shared_ptr<Film> fresh = update.film, retired;
  std::shared_ptr<PreviewHistory> fresh_previews = update.previews;
  std::shared_ptr<DisplayLayer> fresh_display = update.display;
  std::pair<std::shared_ptr<PreviewHistory>, std::shared_ptr<PreviewHistory>> retired_previews;
  std::shared_ptr<const void> retired_count;
  std::shared_ptr<const RenderScene> retired_scene;
  std::shared_ptr<CheckpointMaker::Memory> fresh_checkpoints;
  std::shared_ptr<const PictureCheckpoint> resume = update.resume;
  std::unique_lock lock(mutex);
  bool same_film = true, same_previews = true, same_display = true, same_checkpoints = true;
  while (update.settings || update.channels) {
    const RenderSettings wanted = update.settings ? *update.settings : settings;
    const unsigned wanted_channels = update.channels.value_or(channels);
    same_film = suits(next_film ? *next_film : *film, wanted);
    same_previews = !scene || previews.suit(wanted);
    same_display = suits(next_display ? next_display : display, wanted, wanted_channels, options.oidn);
    const bool film_lacks = !same_film && !(fresh && suits(*fresh, wanted));
    const bool previews_lack = !same_previews && !PreviewFrames::suits(fresh_previews, wanted);
    const bool display_lacks = !same_display && !suits(fresh_display, wanted, wanted_channels, options.oidn);
    same_checkpoints = !checkpoints || checkpoints->suits(wanted);
    const bool checkpoints_lack = !same_checkpoints && !CheckpointMaker::suits(fresh_checkpoints, wanted);
    if (!film_lacks && !previews_lack && !display_lacks && !checkpoints_lack) break;
    lock.unlock();  // clearing the memory of a large film takes long
    if (film_lacks) fresh = make_film(wanted);
    if (previews_lack) fresh_previews = make_preview_history(wanted);
    if (display_lacks) fresh_display = make_display_layer(wanted, wanted_channels, options.oidn);
    if (checkpoints_lack) fresh_checkpoints = checkpoints->make_memory(wanted);
    lock.lock();
  }
  if (same_film) fresh.reset();
  if (same_previews) fresh_previews.reset();
  if (same_display) fresh_display.reset();
  const bool other_scene = update.scene && update.scene != scene;
  const auto difference = other_scene && scene ? scene_difference(*scene, *update.scene) : std::nullopt;

  const RenderSettings& wanted = update.settings ? *update.settings : settings;
  if (resume) {
    const std::optional<View>& wanted_view = update.view ? update.view : view;
    if (!wanted_view || !resume->suits(wanted, *wanted_view)) return 0;
  }
  const double preview_rate = scene ? wanted.preview.rate : 0;
  if (!next_record) next_record = std::make_shared<FrameRecord>();
  if (preview_rate > 0 && !previews.next_record) previews.next_record = std::make_shared<FrameRecord>();

  // Nothing has changed so far, and nothing throws from here on.
  const double now = now_s();
  bool other_picture = false;
  if (update.settings && !same_pictures(*update.settings, settings)) {
    if (fresh || update.settings->rendered_region() != settings.rendered_region()) another_grid = true;
    another_picture = another_kind = other_picture = true;
    if (!same_light(*update.settings, settings)) previews.forget_history();
  }
  if (update.settings) {
    settings = *update.settings;
    retired_previews = previews.set(preview_rate, std::move(fresh_previews));
  }
  if (fresh) {
    retired = std::move(next_film);
    next_film = std::move(fresh);
  }
  if (fresh_display) next_display.swap(fresh_display);
  if (!same_checkpoints) fresh_checkpoints = checkpoints->set_memory(std::move(fresh_checkpoints));
  if (update.scratch_count) retired_count = std::exchange(next_scratch_count, update.scratch_count);
  if (update.view) {
    if (!view || view->camera != update.view->camera || view->time_s != update.view->time_s) {
      another_picture = other_picture = true;
      view_accepted_s = now;
    }
    view = update.view;
  }
  if (other_scene) {
    other_picture = true;
    if (!difference) previews.forget_history();
    const bool sources = !film_state(settings).carried_only;  // which alone can be brought to an edited scene
    if (!difference || (!sources && !difference->empty())) another_kind = true;
    if (!difference || !difference->empty() || !reuses(settings.mode)) {
      another_picture = true;
      view_accepted_s = now;
    }
    retired_scene = std::exchange(scene, update.scene);
    integrate = std::move(tracer);
  }
  if (resume) another_picture = other_picture = true;
  if (other_picture) next_resume.swap(resume);
  if (update.budget) budget = *update.budget;
  if (update.channels) channels = *update.channels;

  ++revision;
  accepted_s = now;
  if (other_picture && view) previews.clock.changed(now);
  if (previewing()) {
    waiting.drop_tiles();
  } else {
    abandon_frame(FrameEndReason::superseded);
  }
  next = view && update.begin ? Next::render : Next::nothing;
  const std::uint64_t mine = revision;
  lock.unlock();
  engine.wake(id);
  return mine;
}

void RenderLoop::Impl::set_rate(std::optional<double> bytes_per_second) {
  {
    const std::lock_guard lock(mutex);
    budget.bytes_per_second = bytes_per_second;
    scheduler.set_rate(bytes_per_second);
  }
  engine.wake(id);
}

void RenderLoop::Impl::move_gaze(const std::optional<Gaze>& gaze) {
  auto record = std::make_shared<FrameRecord>();  // nothing throws with the lock held
  {
    const std::lock_guard lock(mutex);
    if (!view || view->gaze == gaze) return;
    view->gaze = gaze;
    if (settings.foveation.kind != Foveation::density) return;
    view_accepted_s = now_s();
    note_gaze();
    const bool ended = last_reason == FrameEndReason::samples || last_reason == FrameEndReason::error ||
                       last_reason == FrameEndReason::time;
    if (!frame && next == Next::nothing && ended && frames > 0 && !broken) {
      if (!next_record) next_record.swap(record);
      next = Next::render;
    }
  }
  engine.wake(id);
}

// The picture's counts are to follow the view's gaze.
void RenderLoop::Impl::note_gaze() {
  FrameState& state = picture.state;
  ++state.gaze_moves;
  const std::optional<GazeDensity> density = gaze_density(settings, view->gaze);
  const double pilot = allocation_settings(settings)->min_samples;
  state.density_share =
      density ? density->mean_over(settings.rendered_region(), budget.samples ? pilot / *budget.samples : 0) : 1.0;
  state.density_share = std::min(state.density_share, 1.0);
}

void RenderLoop::Impl::cancel() {
  std::shared_ptr<const void> retired;  // freed after the lock
  {
    const std::lock_guard lock(mutex);
    abandon_frame(FrameEndReason::cancelled);
    waiting.cancel_previews();
    retired = previews.release_stage();
    next = Next::nothing;
  }
  engine.wake(id);
}

void RenderLoop::Impl::prepare_checkpoints() {
  std::shared_ptr<CheckpointMaker::Memory> memory;  // freed after the lock
  std::unique_lock lock(mutex);
  while (checkpoints && !checkpoints->suits(settings)) {
    if (CheckpointMaker::suits(memory, settings)) {
      memory = checkpoints->set_memory(std::move(memory));
      return;
    }
    const RenderSettings wanted = settings;
    lock.unlock();
    memory = checkpoints->make_memory(wanted);
    lock.lock();
  }
}

void RenderLoop::Impl::begin_checkpoints(CheckpointOptions checkpoint_options) {
  std::unique_lock lock(mutex);
  std::optional<CheckpointMaker> made;
  while (!checkpoints && !(made && made->suits(settings))) {
    const RenderSettings wanted = settings;
    lock.unlock();  // touching the memory of a large film takes long
    made.emplace(checkpoint_options, wanted);
    lock.lock();
  }
  if (!checkpoints) checkpoints = std::move(made);
}

void RenderLoop::Impl::checkpoint_soon() {
  const std::lock_guard lock(mutex);
  if (checkpoints) checkpoints->clock.ask();
}

void RenderLoop::Impl::republish() {
  {
    const std::lock_guard lock(mutex);
    if (next != Next::nothing || another_picture || !anything_to_show()) return;
    if (frame) {
      picture.state.republish = true;
    } else {
      if (!next_record) next_record = std::make_shared<FrameRecord>();
      next = Next::show_again;
    }
  }
  engine.wake(id);
}

// The film's pixels are of the picture that was asked for last, and say something.
bool RenderLoop::Impl::anything_to_show() const {
  const auto& transfer = picture.transfer;
  if (transfer && !transfer->complete()) return false;
  return picture.samples > 0 || (transfer && transfer->stats().carried > 0);
}

// Ends the frame in flight from outside and drops what it had to say.
void RenderLoop::Impl::abandon_frame(FrameEndReason reason) noexcept {
  waiting.drop_tiles();
  if (!frame) return;
  token->cancel();
  pipeline_of(*frame).stop();
  waiting.drop_tiles_of(*frame);
  if (frame->begin_delivered) {
    end_frame(reason, {});
  } else {
    waiting.drop_frame(*frame);  // the sink never heard of it
    frame.reset();
  }
}

void RenderLoop::Impl::end_frame(FrameEndReason reason, std::string message) noexcept {
  FrameEnd end;
  end.tag = end.progress.tag = frame->begin.tag;
  end.reason = reason;
  end.message = std::move(message);
  if (frame->begin.preview) {
    end.progress.seconds = now_s() - frame->begun_s;
  } else {
    if (frame->begun_s > 0) end.progress = progress_at(now_s());
    last_progress = end.progress;
    last_reason = reason;
  }
  waiting.push(frame->end_slot, {frame, std::move(end)});
  frame.reset();
}

// The sink is told of the frame in flight that it failed, whatever it knows of it.
void RenderLoop::Impl::fail_frame(std::string reason) noexcept {
  token->cancel();
  pipeline_of(*frame).stop();
  waiting.drop_tiles();
  waiting.drop_tiles_of(*frame);
  if (!frame->begin_slot.empty()) waiting.push(frame->begin_slot, {frame, FrameBegun()});
  end_frame(FrameEndReason::failed, std::move(reason));
}

bool RenderLoop::Impl::failed(std::string reason) noexcept {
  const std::lock_guard lock(mutex);
  give_up(std::move(reason));
  return has_work();
}

// Something was thrown: the film may hold half a piece, and the pipeline half a decision. Of a preview alone, if one is
// in hand: the film goes on after it.
void RenderLoop::Impl::give_up(std::string reason) noexcept {
  if (previewing()) {
    previews.spoil();
    return fail_frame(std::move(reason));
  }
  broken = another_picture = another_kind = another_grid = true;
  if (!frame && next != Next::nothing) open_frame(std::move(next_record));
  next = Next::nothing;
  if (frame) fail_frame(std::move(reason));
}

FrameProgress RenderLoop::Impl::progress_at(double now) const {
  const FrameState& state = picture.state;
  FrameProgress p;
  p.tag = frame->begin.tag;
  p.seconds = now - state.begun_s;
  p.samples_per_pixel = state.told();
  const double own_seconds = now - frame->begun_s;
  p.samples_per_second = own_seconds > 0 ? double(frame_samples) / own_seconds : 0;
  p.trace = picture.trace;
  if (picture.transfer && !state.reproject_due) {
    const ReprojectionStats stats = picture.transfer->stats();
    p.verification_rays = stats.rays;
    const double carried = stats.samples - picture.taken_back - double(picture.trace.dropped);
    if (carried > 0) p.reuse_share = carried / (carried + double(picture.samples));
  }
  p.error = state.measured.error;
  p.budget_used = scheduler.budget_used(state, now);
  return p;
}

FrameProgress RenderLoop::Impl::progress() const {
  const std::lock_guard lock(mutex);
  return frame && !previewing() ? progress_at(now_s()) : last_progress;
}

std::size_t RenderLoop::Impl::memory_bytes() const {
  const std::lock_guard lock(mutex);
  return film->bytes() + (next_film ? next_film->bytes() : 0) + pipeline.grid().bytes() + waiting.bytes() +
         techniques.bytes() + (lights ? lights->bytes() : 0) + (display ? display->bytes() : 0) +
         (next_display ? next_display->bytes() : 0) + previews.bytes() + (checkpoints ? checkpoints->bytes() : 0);
}

// Notes that the event is told now, and completes an end.
void RenderLoop::Impl::prepare(SinkEvent& event, double now) {
  FrameRecord& record = *event.frame;
  if (std::holds_alternative<FrameBegun>(event.what)) {
    record.begin_delivered = true;
  } else if (std::holds_alternative<FrameTile>(event.what)) {
    if (record.first_tile_s == 0) record.first_tile_s = now;
  } else {
    auto& end = std::get<FrameEnd>(event.what);
    if (record.first_tile_s > 0) end.first_tile_seconds = record.first_tile_s - record.accepted_s;
    end.passes = pass_times(record);
  }
}

// One worker at a time tells the sink what waits. True: something was told.
bool RenderLoop::Impl::deliver_waiting(std::unique_lock<std::mutex>& lock) noexcept {
  if (delivering || waiting.empty()) return false;
  delivering = true;
  const double began = now_s();
  double now = began;
  while (!waiting.empty() && now - began < kPieceSeconds) {
    SinkEventSlot slot = waiting.pop();
    const std::shared_ptr<FrameRecord> record = slot.front().frame;
    std::optional<std::string> failure;
    double cpu_seconds = 0;
    try {
      prepare(slot.front(), now);
      lock.unlock();
      const double cpu_started = thread_used_s();
      deliver(slot.front(), *sink);
      cpu_seconds = thread_used_s() - cpu_started;
    } catch (...) {
      failure = failure_reason();
    }
    now = now_s();
    if (!lock.owns_lock()) lock.lock();
    record->publish_seconds += cpu_seconds;
    if (failure) sink_failed(record, slot, std::move(*failure));
  }
  delivering = false;
  return true;
}

// The sink threw when it was told the event. A frame whose beginning or whose tile it does not have has failed.
void RenderLoop::Impl::sink_failed(const std::shared_ptr<FrameRecord>& record, SinkEventSlot& slot,
                                   std::string reason) noexcept {
  const auto fail = [&](FrameEnd& end) {
    if (end.reason == FrameEndReason::superseded || end.reason == FrameEndReason::cancelled) return;
    end.reason = FrameEndReason::failed;
    end.message = std::move(reason);
  };
  if (auto* end = std::get_if<FrameEnd>(&slot.front().what)) {
    fail(*end);
    if (++record->end_tries < kMostEndTries) waiting.put_back(slot);
  } else if (record == frame) {
    fail_frame(std::move(reason));
  } else if (FrameEnd* end = waiting.end_of(*record)) {
    fail(*end);
  }
}

// The frame that was asked for is in flight from here on, and may fail.
void RenderLoop::Impl::open_frame(std::shared_ptr<FrameRecord> record) noexcept {
  frame = std::move(record);
  frame->begin.tag = {revision, view->id, ++frames};
  frame->begin.region = settings.rendered_region();
  frame->begin.camera = fitted(view->camera, settings.width, settings.height);
  frame->begin.exposure = view->exposure;
  frame->begin.gaze = view->gaze;
  frame->begin.scene = scene;
  frame->begin.settings = frame_settings();
  frame->accepted_s = accepted_s;
}

// Nothing: not every pixel of the film is of one view. Precondition: no piece is in flight.
std::optional<RestingFilm> RenderLoop::Impl::resting_film() const {
  if (broken || picture.samples == 0 || picture.state.reproject_due || !pipeline.grid().all_rendered()) return {};
  return RestingFilm{*film, display.get(), film_scene.lock().get(), film_camera, pipeline.grid().region()};
}

// Precondition: one is due, and no frame and no piece is in flight.
void RenderLoop::Impl::begin_preview(Retired& retired) {
  const double now = now_s();
  previews.clock.begun(now);
  open_frame(std::move(previews.next_record));
  frame->begin.preview = true;
  frame->begin.changed_s = accepted_s;
  frame->begin.notice = aspect_notice(view->camera, settings.width, settings.height);
  frame->begun_s = now;
  token = std::make_shared<CancelToken>();
  const std::optional<RestingFilm> rest = resting_film();
  auto [history, stage] = previews.begin(*frame, scene, token, *film, rest ? &*rest : nullptr);
  retired.add(std::move(stage));
  retired.add(std::move(history));
  planned = true;
  waiting.push(frame->begin_slot, {frame, FrameBegun()});
}

void RenderLoop::Impl::begin_frame(Retired& retired) {
  // The plan that the transfer began may have been cut short after it.
  const auto& transfer = picture.transfer;
  if (picture.state.reproject_due && transfer && transfer->complete()) {
    transfer->note(picture);
    pipeline.mark_prepared();
  }
  const bool show_again = next == Next::show_again;
  open_frame(std::move(next_record));
  next = Next::nothing;
  previews.clock.film_begun();
  if (broken) pipeline = FramePipeline(engine.threads(), kPieceSeconds);
  broken = false;
  if (next_scratch_count) retired.add(std::exchange(scratch_count, std::move(next_scratch_count)));
  if (next_film) retired.add(std::exchange(film, std::move(next_film)));
  if (next_display) {
    if (display && display->by_oidn() != next_display->by_oidn()) picture.state.display_seconds = 0;
    retired.add(std::exchange(display, std::move(next_display)));
  }
  if (!(channels & kResolveDisplay)) retired.add(std::exchange(display, nullptr));
  if (!display) picture.state.display_seconds = 0;
  if (another_grid) pipeline.set_grid(settings.rendered_region(), options.tile_size);
  film_scene = scene;
  film_camera = frame->begin.camera;
  retired.add(previews.release_stage());
  const bool reuse = film->history() && scene;
  if (reuse && !history.film_usable()) another_picture = true;
  if (another_picture) pipeline.forget_samples();
  if (another_picture || another_grid) {
    frame->begin.changed_s = accepted_s;
    begin_picture(reuse, retired);
  }
  if (!caches_light_vertices(settings.integrator) || !scene) {
    retired.add(std::exchange(lights, nullptr));
  } else if (!lights || !lights->suits(scene, path_settings(frame_settings()))) {
    retired.add(std::exchange(lights, std::make_shared<LightVertexSource>(scene, path_settings(frame_settings()),
                                                                          options.keep_light_vertices)));
  }
  FrameState& state = picture.state;
  if (settings.foveation.kind == Foveation::density) note_gaze();
  // A plan may have been cut short after it had chosen, or before it could.
  state.choice_due =
      settings.integrator == Integrator::pt_bdpt && scene && !film->light_tiles() && picture.samples == 0;
  state.round.samples = picture.samples;
  state.round.pixels = std::uint64_t(settings.rendered_region().area());
  another_picture = another_grid = another_kind = false;

  frame->begin.settings = frame_settings();  // the seed is that of the generation by now
  if (scene) frame->begin.unsampled = unsampled_light(settings.integrator, scene->features());
  frame->begin.notice = aspect_notice(view->camera, settings.width, settings.height);
  token = std::make_shared<CancelToken>();
  scheduler = FrameScheduler(budget, publish_policy(), allocation_settings(settings));
  frame_samples = 0;
  planned = false;

  frame->begun_s = now_s();
  waiting.push(frame->begin_slot, {frame, FrameBegun()});
  state.revision = revision;
  state.begun_s = frame->begun_s - (state.restore_due ? picture.resume->seconds() : 0);
  state.published = state.published_final = state.republish = false;
  state.published_samples = 0;
  state.tiles = pipeline.grid().tiles().size();
  const double bytes_per_pixel = options.bytes_per_pixel > 0 ? options.bytes_per_pixel : 2.0 * plane_count(channels);
  state.publish_bytes = bytes_per_pixel * double(pipeline.grid().region().area());
  pipeline.grid().done_everywhere(state.done);
  pipeline.begin_frame();

  if (show_again) {
    FramePlan plan;
    plan.revision = revision;
    plan.publish = Publish::round;
    plan.final = true;
    if (display_due()) plan.after.push_back(StageId::display);
    plan.end = last_reason;
    planned_gaze_moves = state.gaze_moves;
    pipeline.start(plan, *film, make_stages(plan, stage_context()));
    planned = true;
  }
}

// The film's samples are of no use to the picture that begins, unless as a source of history (reuse).
void RenderLoop::Impl::begin_picture(bool reuse, Retired& retired) {
  if (another_kind || another_grid) {
    for (auto& held : history.forget()) retired.add(std::move(held));
    if (film->extension()) film->extension()->forget();
    techniques.forget();
  } else if (reuse) {
    ++history.generation;
  }
  half_allocated = false;
  PictureState begun;
  begun.state = with_costs_of(picture.state);
  begun.state.reproject_due = reuse;
  // A transfer that was stopped before it overwrote the film has left it as it was.
  const bool left = !picture.state.reproject_due || !history.film_usable();
  begun.left_samples = left ? picture.samples : picture.left_samples;
  begun.resume = std::exchange(next_resume, nullptr);
  begun.state.restore_due = begun.resume != nullptr;
  retired.add(std::move(picture.resume));
  picture = std::move(begun);
  if (checkpoints) checkpoints->clock.begin(now_s());
  if (display) display->forget();
  if (film->targets()) film->targets()->demand_known = false;
  film->set_light_tiles(nullptr);
  // A picture that is drawn on keeps them until it has become a source (stages/history_transfer.h).
  if (film->splats() && !(reuse && history.film_usable())) film->splats()->clear();
  if (lights) retired.add(lights->set_aside());
}

StageContext RenderLoop::Impl::stage_context() {
  return {scene,
          frame->begin.settings,
          frame->begin.camera,
          token,
          *film,
          pipeline.grid(),
          history,
          reuses(settings.mode) ? &techniques : nullptr,
          display.get(),
          picture,
          frame->begin.tag.view_id,
          checkpoints ? &*checkpoints : nullptr,
          gaze_density(settings, view->gaze)};
}

// Whether the picture can be copied, and is to be.
bool RenderLoop::Impl::checkpoint_due(double now) const {
  return checkpoints && picture.samples > 0 && !half_allocated && checkpoints->free() && checkpoints->clock.due(now) &&
         (!lights || lights->settled(picture.state.done));
}

// Whether the next publication is to be filtered for the eye first. Before both halves have samples there is nothing to
// filter by.
bool RenderLoop::Impl::display_due() const {
  const FrameState& state = picture.state;
  const bool both_halves = state.round.number > 0 || std::min(state.done[0], state.done[1]) > 0;
  return display && display->failure().empty() && both_halves &&
         !(display->known() && state.displayed == picture.samples);
}

void RenderLoop::Impl::note_finished_plan(double now) {
  const FramePlan& plan = pipeline.plan();
  FrameState& state = picture.state;
  if (!pipeline.cut()) half_allocated = false;
  pipeline.grid().done_everywhere(state.done);

  const std::uint64_t added = picture.samples - state.round.samples;
  state.round.samples = picture.samples;
  // Samples that stages ran beside have taken longer.
  if (added > 0 && !pipeline.cut() && !plan.by_tile)
    blend(state.sample_seconds, pipeline.seconds(StageId::integrate) * double(state.round.pixels) / double(added));
  blend(state.measure_seconds, pipeline.seconds(StageId::measure));
  blend(state.display_seconds, pipeline.seconds(StageId::display));
  blend(state.publish_seconds, pipeline.seconds(StageId::resolve));
  if (const double seconds = pipeline.seconds(StageId::checkpoint); seconds > 0) {
    checkpoints->clock.ended(seconds, now);
    checkpoints->tell_pause(seconds);
  }
  const std::uint64_t samples = picture.samples;
  for (const auto& stage : pipeline.finished_stages()) stage->note(picture);
  if (picture.samples > samples) {  // they were restored
    invalid_samples += picture.trace.invalid();
    // What they took, all in all, until some are taken here: a plan without a cost lasts until the count has doubled.
    if (state.sample_seconds == 0)
      state.sample_seconds = (now - state.begun_s) * double(state.round.pixels) / double(picture.samples);
  }

  if (plan.publish != Publish::none && (plan.publish == Publish::early || !pipeline.cut())) {
    state.published = true;
    state.published_samples = state.total();
    state.round.published = state.round.samples;
    state.published_s = now;
    state.published_final = pipeline.published_final();
    if (plan.publish == Publish::round) state.republish = false;
  }
}

// Samples per pixel that tiles' densities are relative to; of tiles that are shown one by one those of the whole round.
double RenderLoop::Impl::mean_of_tiles() const {
  const RoundState& round = picture.state.round;
  if (planned && pipeline.plan().by_tile && pipeline.plan().round) return 1;  // how many it will be nobody knows
  if (round.number == 0) return 0;
  std::uint64_t samples = picture.samples;
  if (planned && pipeline.plan().publish == Publish::early) {
    samples = round.samples;
    for (const auto& octaves : round.summary.by_octave)
      samples = std::accumulate(octaves.begin(), octaves.end(), samples);
  }
  return double(samples) / double(round.pixels);
}

// Precondition: a frame is in flight, its plan is over and no piece is.
void RenderLoop::Impl::advance(std::size_t backlog) {
  const double now = now_s();
  if (previewing()) {
    previews.note_end();
    return end_frame(FrameEndReason::preview, {});
  }
  if (planned) {
    note_finished_plan(now);
    if (pipeline.plan().end && !pipeline.cut()) {
      // The end was decided before the gaze moved: the picture goes on in a frame of its own.
      const bool goes_on = planned_gaze_moves != picture.state.gaze_moves && next == Next::nothing;
      if (goes_on && !next_record) next_record = std::make_shared<FrameRecord>();
      end_frame(*pipeline.plan().end, {});
      if (goes_on) next = Next::render;
      return;
    }
  }
  FrameState& state = picture.state;
  state.tiles_alone = !film->splats() && !lights;
  state.display_due = display_due();
  state.checkpoint_due = checkpoint_due(now);
  state.checkpoint_asked = checkpoints && checkpoints->clock.asked();
  const FramePlan plan = scheduler.plan_next(state, now - view_accepted_s, backlog, now);
  planned_gaze_moves = state.gaze_moves;
  FrameStages stages = make_stages(plan, stage_context());
  half_allocated |= std::any_of(plan.before.begin(), plan.before.end(),
                                [](const StageRequest& stage) { return stage.id == StageId::allocate; });
  if (lights) {
    const Camera camera(frame->begin.camera, settings.width, settings.height, scene->origin(), settings.filter);
    lights->aim(camera, token, *film);
  }
  pipeline.start(plan, *film, std::move(stages), lights);
  planned = true;
}

std::optional<Piece> RenderLoop::Impl::take(std::size_t backlog, Retired& retired) {
  for (;;) {
    if (next_due()) {
      const PreviewClock::Decision due = what_next();
      if (running > 0 || due.at_s > now_s()) return std::nullopt;
      if (due.next == PreviewClock::Next::preview) {
        begin_preview(retired);
      } else {
        begin_frame(retired);
      }
    }
    if (!frame) return std::nullopt;
    if (!planned || (pipeline_of(*frame).over() && running == 0)) advance(backlog);
    if (!picture.state.restore_due) retired.add(std::move(picture.resume));
    if (!frame) continue;
    FramePipeline& own = pipeline_of(*frame);
    if (auto piece = own.take(room(), now_s())) return piece;
    if (!own.over()) return std::nullopt;
  }
}

bool RenderLoop::Impl::run_piece() {
  const std::size_t backlog = sink->backlog();
  Retired retired;
  std::unique_lock lock(mutex);
  try {
    run_piece(lock, backlog, retired);
  } catch (...) {
    // Before another worker sees what was left half done.
    give_up(failure_reason());
  }
  return has_work();
}

// Throws with the lock held.
void RenderLoop::Impl::run_piece(std::unique_lock<std::mutex>& lock, std::size_t backlog, Retired& retired) {
  if (deliver_waiting(lock)) return;
  std::optional<Piece> piece = take(backlog, retired);
  if (!piece) return;

  ++running;  // nothing throws until it is counted down
  const std::shared_ptr<FrameRecord> mine = frame;
  const std::shared_ptr<CancelToken> cancelled = token;
  const CameraPose camera = mine->begin.camera;
  const std::shared_ptr<const IntegrateFunction> tracer = integrate;
  const unsigned wanted_channels = channels;
  const double mean_samples = mean_of_tiles();
  const bool of_preview = mine->begin.preview;
  const std::shared_ptr<PreviewStage> shown = of_preview ? previews.stage() : nullptr;
  const std::shared_ptr<const DisplayLayer> layer = display;
  Film& pixels = *film;
  lock.unlock();

  const double cpu_started = thread_used_s();
  bool done = true;
  std::optional<std::string> failure;
  TraceStats stats;
  FrameTile tile;
  try {
    if (const auto* p = std::get_if<IntegratePiece>(&*piece)) {
      done = run_integrate(*p, *tracer, camera, mine->begin.settings, *cancelled, pixels, stats);
    } else if (const auto* p = std::get_if<StageItem>(&*piece)) {
      run(*p, stats);
    } else if (shown) {
      tile = shown->resolve(std::get<ResolvePiece>(*piece), mine->begin.tag);
    } else {
      tile = run_resolve(std::get<ResolvePiece>(*piece), mine->begin.tag, wanted_channels, mean_samples, pixels,
                         layer.get());
    }
  } catch (...) {
    failure = failure_reason();
  }
  const double ended = now_s(), cpu_seconds = thread_used_s() - cpu_started;
  const auto* integrated = std::get_if<IntegratePiece>(&*piece);

  lock.lock();
  --running;
  if (of_preview) {
    previews.finish(*piece, done && !failure, cpu_seconds, ended);
  } else if (!broken) {
    pipeline.finish(*piece, done && !failure, cpu_seconds, ended);
  }
  const bool current = frame == mine;
  mine->stage_seconds[std::size_t(stage_of(*piece))] += cpu_seconds;
  // Samples that were thrown away are not the film's; light paths stay where they landed.
  if (!of_preview && (!integrated || (done && !failure))) {
    picture.trace.add(stats);
    invalid_samples += stats.invalid_samples + stats.invalid_splats;
  }
  RenderTotals totals{0, stats.rays, 0};
  if (integrated && done && !failure) {
    picture.samples += integrated->samples;
    if (current) frame_samples += integrated->samples;
    totals.samples = integrated->samples;
  }
  if (!of_preview && (!integrated || (done && !failure))) totals.invalid_samples = stats.invalid();
  engine.count(totals);
  if (current && !failure && std::holds_alternative<ResolvePiece>(*piece)) waiting.push({mine, std::move(tile)});
  if (failure) {
    if (of_preview) {
      previews.forget_history();
    } else {
      another_picture = another_kind = true;  // the film may hold half a piece
    }
    if (current) fail_frame(std::move(*failure));
  }
  deliver_waiting(lock);
}

std::shared_ptr<Film> make_film(const RenderSettings& settings, std::shared_ptr<const void> count) {
  return counted(std::move(count), Film(settings.width, settings.height, film_state(settings)));
}

std::shared_ptr<PreviewHistory> make_preview_history(const RenderSettings& settings,
                                                     std::shared_ptr<const void> count) {
  if (!(settings.preview.rate > 0)) return nullptr;
  return counted(std::move(count), PreviewHistory(settings.width, settings.height, as_published(settings)));
}

std::shared_ptr<DisplayLayer> make_display_layer(const RenderSettings& settings, unsigned channels,
                                                 const std::shared_ptr<const OidnLibrary>& oidn,
                                                 std::shared_ptr<const void> count) {
  if (!(channels & kResolveDisplay)) return nullptr;
  if ((channels & kDisplayByOidn) && oidn)
    return counted(std::move(count), DisplayLayer(settings.width, settings.height, oidn));
  return counted(std::move(count), DisplayLayer(settings.width, settings.height));
}

RenderLoop::RenderLoop(RenderEngine& engine, std::shared_ptr<const RenderScene> scene, const RenderSettings& settings,
                       const Budget& budget, RenderRank rank, std::shared_ptr<FrameSink> sink,
                       const RenderLoopOptions& options)
    : impl_(std::make_unique<Impl>(engine.impl(), make_tracer(scene, options), scene, settings, budget, rank,
                                   std::move(sink), options)) {}

RenderLoop::RenderLoop(RenderEngine& engine, IntegrateFunction integrate, const RenderSettings& settings,
                       const Budget& budget, RenderRank rank, std::shared_ptr<FrameSink> sink,
                       const RenderLoopOptions& options)
    : impl_(std::make_unique<Impl>(engine.impl(), std::move(integrate), nullptr, settings, budget, rank,
                                   std::move(sink), options)) {}

RenderLoop::~RenderLoop() = default;
std::uint64_t RenderLoop::update(const Update& update) {
  return impl_->update(update);
}
bool RenderLoop::film_suits(const RenderSettings& settings) const {
  const std::lock_guard lock(impl_->mutex);
  return suits(impl_->next_film ? *impl_->next_film : *impl_->film, settings);
}
bool RenderLoop::previews_suit(const RenderSettings& settings) const {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->scene || impl_->previews.suit(settings);
}
bool RenderLoop::display_suits(const RenderSettings& settings, unsigned channels) const {
  const std::lock_guard lock(impl_->mutex);
  return suits(impl_->next_display ? impl_->next_display : impl_->display, settings, channels, impl_->options.oidn);
}
void RenderLoop::set_rate(std::optional<double> bytes_per_second) {
  impl_->set_rate(bytes_per_second);
}
void RenderLoop::move_gaze(const std::optional<Gaze>& gaze) {
  impl_->move_gaze(gaze);
}
void RenderLoop::cancel() {
  impl_->cancel();
}
std::uint64_t RenderLoop::revision() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->revision;
}
FrameProgress RenderLoop::progress() const {
  return impl_->progress();
}
double RenderLoop::used_seconds() const {
  return impl_->engine.used_seconds(impl_->id);
}

void RenderLoop::hold_others(double seconds) {
  impl_->engine.hold(impl_->id, seconds);
}

void RenderLoop::release_others() {
  impl_->engine.release(impl_->id);
}
std::size_t RenderLoop::memory_bytes() const {
  return impl_->memory_bytes();
}
std::uint64_t RenderLoop::invalid_samples() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->invalid_samples;
}

void RenderLoop::prepare_checkpoints() {
  impl_->prepare_checkpoints();
}

void RenderLoop::begin_checkpoints(CheckpointOptions options) {
  impl_->begin_checkpoints(std::move(options));
}

void RenderLoop::checkpoint_soon() {
  impl_->checkpoint_soon();
}
void RenderLoop::republish() {
  impl_->republish();
}

}  // namespace helio
