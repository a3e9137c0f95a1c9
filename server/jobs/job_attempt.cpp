#include "server/jobs/job_attempt.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/base/unix_time.h"
#include "renderer/codec/atomic_file.h"
#include "renderer/frame/checkpoint/checkpoint_clock.h"
#include "renderer/frame/checkpoint/checkpoint_picture.h"
#include "renderer/frame/failure_reason.h"
#include "server/base/build_info.h"
#include "server/base/guarded.h"
#include "server/base/retry.h"
#include "server/jobs/kept_checkpoint.h"
#include "server/jobs/load_kept_scene.h"

namespace helio {
namespace {

constexpr std::chrono::milliseconds kCurveInterval(250);  // between looks at the error of a view

bool may_go_away(const Error& error) {
  return error.code == ErrorCode::resource_exhausted || error.code == ErrorCode::unavailable;
}

JobAttempt::Outcome failed(const Error& error) {
  JobAttempt::Outcome outcome;
  outcome.change.to = may_go_away(error) ? JobState::queued : JobState::failed;
  outcome.change.reason = error.to_string();
  if (may_go_away(error)) outcome.retry_after_s = std::max(error.retry_after_s, kRetrySeconds);
  return outcome;
}

JobAttempt::Outcome succeeded() {
  JobAttempt::Outcome outcome;
  outcome.change.to = JobState::succeeded;
  return outcome;
}

JobAttempt::Outcome paused(std::string reason) {
  JobAttempt::Outcome outcome;
  outcome.change.to = JobState::paused;
  outcome.change.reason = std::move(reason);
  return outcome;
}

}  // namespace

std::string rendering_build(const std::string& device) {
  return build_description() + "; " + rendering_isa() + (device.empty() || device == "cpu" ? "" : "; " + device);
}

JobAttempt::JobAttempt(JobStores& stores, JobRecord record, std::function<void(const Outcome&)> over)
    : stores_(stores),
      record_(std::move(record)),
      over_(std::move(over)),
      same_bits_(record_.same_bits),
      thread_([this] { run(); }) {}

JobAttempt::~JobAttempt() {
  ask(Request::suspend, {});
  thread_.join();
}

void JobAttempt::ask(Request request, const std::string& by) {
  const std::lock_guard lock(signals_->mutex);
  if (request <= signals_->asked) return;
  signals_->asked = request;
  signals_->asked_by = by;
  loading_.cancel();
  signals_->changed.notify_all();
}

std::optional<KeptProgress> kept_progress(const CheckpointHeader& header) {
  KeptProgress kept{header.view, {}, header.time_s};
  if (header.frame_end || header.progress.empty() || !kept.progress.ParseFromString(header.progress))
    return std::nullopt;
  return kept;
}

std::optional<KeptProgress> JobAttempt::kept() const {
  const std::lock_guard lock(signals_->mutex);
  return signals_->kept;
}

void JobAttempt::checkpoint_soon(double max_age_s) {
  std::unique_lock lock(signals_->mutex);
  const auto rendering = signals_->rendering.lock();
  // Whoever looks on, as often as he likes, takes no more of the job's time than the checkpoints that nobody asks for.
  const double now = unix_time_s();
  const bool old = !signals_->kept || now - signals_->kept->checkpoint_s > max_age_s;
  const bool may = now > signals_->next_asked_s;
  lock.unlock();
  if (rendering && old && may) rendering->loop().checkpoint_soon();
}

std::optional<JobAttempt::Progress> JobAttempt::progress() const {
  std::unique_lock lock(signals_->mutex);
  const auto rendering = signals_->rendering.lock();
  const ErrorCurve curve = signals_->curve;
  const double views = signals_->views_left;
  lock.unlock();
  if (!rendering) return std::nullopt;
  Progress progress{rendering->loop().progress(), std::nullopt};
  progress.left = time_left(progress.frame, double(planned_->plan.settings.rendered_region().area()),
                            planned_->plan.budget, curve);
  if (!progress.left) return progress;
  // The views that follow take as long as this one.
  const double before = progress.frame.seconds;
  for (double* seconds : {&progress.left->seconds, &progress.left->low_s, &progress.left->high_s})
    *seconds += views * (before + *seconds);
  return progress;
}

void JobAttempt::run() {
  Outcome outcome;
  const Status worked = guarded([&] { return outcome = work(), ok_status(); });
  rendering_.reset();
  const auto tell = [&] {
    Outcome told = worked.ok() ? outcome : failed(worked.error());
    told.change.from = {JobState::running};
    told.change.same_bits = same_bits_;
    for (const std::string& note : notes_) told.change.reason += (told.change.reason.empty() ? "" : "; ") + note;
    over_(told);
    return ok_status();
  };
  // Without memory, later: nobody else ends the attempt.
  while (!guarded(tell).ok()) std::this_thread::sleep_for(std::chrono::seconds(1));
}

JobAttempt::Outcome JobAttempt::work() {
  if (!request_.ParseFromString(record_.request))
    return failed({ErrorCode::internal, "its request in the state folder cannot be read", {}});
  build_ = rendering_build(request_.job().settings().device());
  if (record_.views_done == record_.views) return succeeded();
  if (const Status loaded = load(); !loaded.ok()) {
    if (auto stop = asked_to_stop()) return std::move(*stop);
    return failed(loaded.error());
  }
  if (record_.views_done > 0 && record_.build != build_) {
    if (auto stop = on_another_build(record_.build)) return std::move(*stop);
  }
  for (std::uint32_t view = first_view(); view < record_.views; ++view) {
    if (auto stop = render_view(view)) return std::move(*stop);
  }
  return succeeded();
}

// Modes that reuse pictures draw on the views before, which an attempt before this one has rendered: either all begin
// anew, or the bits are others.
std::uint32_t JobAttempt::first_view() {
  if (record_.views_done == 0 || !reuses(planned_->plan.settings.mode)) return record_.views_done;
  if (request_.require_same_bits()) return 0;
  same_bits_ = false;
  return record_.views_done;
}

// The scene is held from here on, loaded again if need be.
Status JobAttempt::load() {
  ServiceCore& core = stores_.core;
  auto held = core.scenes.acquire(record_.scene_id, "scene_id");
  if (!held) {
    const std::lock_guard one_at_a_time(stores_.loading);
    if (asked_to_stop()) return Error{ErrorCode::cancelled, "it was asked to stop", {}};
    held = load_kept_scene(core, stores_.scenes, record_.scene_id, record_.owner, loading_);
    if (!held) return held.error();
  }
  auto planned = plan_job(core, request_.job(), "job");
  if (!planned) return planned.error();
  planned_ = std::move(*planned);
  return ok_status();
}

// The share of whoever submitted the job.
MemoryAccount& JobAttempt::account() {
  return stores_.core.memory_of(record_.owner);
}

Status JobAttempt::begin_rendering() {
  const JobPlan& plan = planned_->plan;
  picture_ = std::make_shared<JobPicture>(account(), plan.format, [signals = signals_] {
    const std::lock_guard lock(signals->mutex);
    signals->frame_ended = true;
    signals->changed.notify_all();
  });
  std::optional<CheckpointOptions> checkpoints;
  if (can_checkpoint(plan.settings)) {
    checkpoints.emplace();
    checkpoints->interval_s = stores_.checkpoint_interval_s;
    checkpoints->prepare_later = true;
    checkpoints->paused = [&pause = stores_.core.counters.checkpoints.pause, signals = signals_](double s) {
      pause.observe(s);
      signals->next_asked_s = unix_time_s() + s / CheckpointClock::kMostShare;
    };
    checkpoints->keep = [signals = signals_](std::shared_ptr<const PictureCheckpoint> checkpoint) {
      const std::lock_guard lock(signals->mutex);
      signals->checkpoint = std::move(checkpoint);
      signals->changed.notify_all();
    };
  }
  auto rendering = RenderContext::create(stores_.core.resources(record_.owner), std::move(planned_->scene), plan.settings,
                                         plan.budget, RenderRank::job, FramePublisher::Tiles::final_only,
                                         plan.format.channels, picture_, std::move(checkpoints));
  if (!rendering) return rendering.error();
  if (const Status fits = picture_->reserve(plan.settings.rendered_region()); !fits.ok()) return fits;
  rendering_ = std::move(*rendering);
  const std::lock_guard lock(signals_->mutex);
  signals_->rendering = rendering_;
  return ok_status();
}

// A part of the job was rendered by this build.
std::optional<JobAttempt::Outcome> JobAttempt::on_another_build(const std::string& build) {
  same_bits_ = false;
  if (!request_.require_same_bits()) return std::nullopt;
  same_bits_ = record_.same_bits;
  return paused(fmt::format("a part of it was rendered by another build or instruction path ({}; this one: {}), and "
                            "require_same_bits is set; resume it with the other one, or cancel it",
                            build, build_));
}

// What the newest checkpoint of the view has: its picture, or, of a finished one, its file.
Result<JobAttempt::Resumed> JobAttempt::find_checkpoint(std::uint32_t view) {
  Resumed resumed;
  const JobPlan& plan = planned_->plan;
  const std::uint64_t file = std::uint64_t(plan.settings.rendered_region().area()) * plan.format.planes() * 8;
  const std::uint64_t most = std::max(checkpoint_bytes(plan.settings), file) + kMostHeaderBytes;
  auto memory = account().reserve_with_room(most, "the checkpoint of a job", MemoryOwner::checkpoints);
  if (!memory) return memory.error();
  auto newest = stores_.checkpoints.read(record_.id, most);
  for (;;) {
    for (const std::string& line : newest.damaged) note(line);
    if (!newest.file) return Resumed();
    const std::uint64_t number = newest.file->number;
    const auto header = CheckpointHeader::read(newest.file->header);
    std::string useless;
    if (!header) {
      useless = header.error().message;
    } else if (header->view != view) {
      // It is of a view before.
    } else if (header->frame_end) {
      resumed.header = *header;
      resumed.file = std::move(newest.file->body);
      resumed.memory = std::move(*memory);
      return resumed;
    } else {
      auto picture = PictureCheckpoint::decode(std::move(newest.file->body), planned_->plan.settings);
      const Status suits = picture ? picture->suits(planned_->plan.settings, planned_->plan.views[view])
                                   : Status(picture.error());
      if (suits.ok()) {
        resumed.header = *header;
        resumed.picture = counted(std::move(*memory), std::move(*picture));
        return resumed;
      }
      useless = suits.error().to_string();
    }
    if (!useless.empty()) note(fmt::format("checkpoint {} was of no use: {}", number, useless));
    newest = stores_.checkpoints.read_before(record_.id, number, most);
  }
}

std::optional<JobAttempt::Outcome> JobAttempt::render_view(std::uint32_t view) {
  if (auto stop = asked_to_stop()) return stop;
  auto found = find_checkpoint(view);
  if (!found) return failed(found.error());
  Resumed resumed = std::move(*found);
  if (resumed.header && resumed.header->build != build_) {
    if (auto stop = on_another_build(resumed.header->build)) return stop;
  }
  if (resumed.header && !resumed.header->same_bits) same_bits_ = false;
  if (!resumed.file.empty() && view + 1 < record_.views && reuses(planned_->plan.settings.mode)) {
    // The views that follow draw on this one: while all bits can still be those of an undisturbed job it is rendered for
    // that, although its file is there; else they begin without its history.
    if (same_bits_ && !planned_->plan.budget.time_s) resumed = {};
    else same_bits_ = false;
  }
  if (!resumed.file.empty()) return write_view(view, resumed.file, *resumed.header->frame_end);

  if (!rendering_) {
    if (const Status begun = begin_rendering(); !begun.ok()) return failed(begun.error());
  }
  {
    const std::lock_guard lock(signals_->mutex);
    signals_->curve = {};
    signals_->views_left = record_.views - view - 1;
    signals_->frame_ended = false;
    signals_->checkpoint.reset();
  }
  RenderLoop::Update update;
  update.view = planned_->plan.views[view];
  update.resume = std::move(resumed.picture);
  revision_ = rendering_->loop().update(update);
  rendering_->loop().prepare_checkpoints();
  auto end = wait_for_end(view);
  if (auto* stop = std::get_if<Outcome>(&end)) return std::move(*stop);
  return finish_view(view, std::get<FrameEnd>(end));
}

std::variant<FrameEnd, JobAttempt::Outcome> JobAttempt::wait_for_end(std::uint32_t view) {
  RenderLoop& loop = rendering_->loop();
  bool last_one = false;  // the checkpoint that is waited for is the attempt's last
  Signals& told = *signals_;
  std::unique_lock lock(told.mutex);
  for (;;) {
    const auto something = [&] {
      return told.frame_ended || told.checkpoint || told.asked == Request::cancel ||
             (told.asked != Request::none && !last_one);
    };
    while (!told.changed.wait_for(lock, kCurveInterval, something)) {
      lock.unlock();
      const FrameProgress progress = loop.progress();
      lock.lock();
      told.curve.add(progress);
    }
    auto checkpoint = std::exchange(told.checkpoint, nullptr);
    const bool ended = std::exchange(told.frame_ended, false);
    const Request asked = told.asked;
    const std::string by = told.asked_by;
    lock.unlock();
    if (ended) {
      if (auto end = picture_->end(revision_)) return std::move(*end);
    }
    if (checkpoint) write_checkpoint(view, *checkpoint);
    // Without a sample there is nothing to keep.
    const bool keeps = asked != Request::none && asked != Request::cancel &&
                       can_checkpoint(planned_->plan.settings) && loop.progress().samples_per_pixel > 0;
    if (asked != Request::none && (!keeps || (last_one && checkpoint))) {
      loop.cancel();
      return stopped(asked, by);
    }
    checkpoint.reset();  // the next one may be taken
    if (keeps && !last_one) {
      last_one = true;
      loop.checkpoint_soon();
    }
    lock.lock();
  }
}

// For the log, and for whoever reads how the attempt ended.
void JobAttempt::note(const std::string& text) {
  constexpr std::size_t kMostNotes = 4;
  spdlog::warn("{} job={}", text, record_.id);
  if (notes_.size() < kMostNotes && std::find(notes_.begin(), notes_.end(), text) == notes_.end())
    notes_.push_back(text);
}

void JobAttempt::write_checkpoint(std::uint32_t view, const PictureCheckpoint& checkpoint) {
  look_at_device();
  FrameProgress progress = progress_of(checkpoint);
  progress.budget_used = rendering_->loop().progress().budget_used;
  CheckpointHeader header{view, build_, same_bits_, std::nullopt};
  header.progress = to_message(progress, record_.id).SerializeAsString();
  header.time_s = unix_time_s();
  const std::span<const std::uint8_t> body[] = {checkpoint.encode()};
  CheckpointCounters& counters = stores_.core.counters.checkpoints;
  const double began = now_s();
  const Status written = stores_.checkpoints.write(record_.id, header.write(), body);
  if (!written.ok()) {
    counters.failures.add();
    return note("a checkpoint was not written: " + written.error().to_string());
  }
  counters.write.observe(now_s() - began);
  const std::lock_guard lock(signals_->mutex);
  signals_->kept = kept_progress(header);
}

// What a device that has failed left to the processor has other last bits.
void JobAttempt::look_at_device() {
  const std::string failed = rendering_->device_failure();
  if (failed.empty()) return;
  same_bits_ = false;
  note(failed);
}

std::optional<JobAttempt::Outcome> JobAttempt::finish_view(std::uint32_t view, const FrameEnd& end) {
  // What lacked memory may have it later, and goes on from its newest checkpoint.
  const ErrorCode code = end.message == kOutOfMemory ? ErrorCode::resource_exhausted : ErrorCode::internal;
  if (end.reason == FrameEndReason::failed) return failed({code, end.message, {}});
  if (end.reason == FrameEndReason::cancelled) return stopped(Request::cancel, {});
  look_at_device();
  const auto file = picture_->encode(origin_of(view));
  if (!file) return failed(file.error());
  return write_view(view, *file, to_message(FrameReport{end, 0, 0, {}}, record_.id).SerializeAsString());
}

// The fields that JobPicture::encode() cannot know.
pb::PictureOrigin JobAttempt::origin_of(std::uint32_t view) const {
  const pb::RunJobRequest& job = request_.job();
  pb::PictureOrigin origin;
  origin.set_scene_id(record_.scene_id);
  if (job.views_size() > 0) {
    *origin.mutable_camera() = job.views(int(view));
  } else if (job.has_camera()) {
    *origin.mutable_camera() = job.camera();
  }
  *origin.mutable_budget() = job.budget();
  origin.mutable_budget()->clear_bytes_per_second();
  origin.mutable_budget()->clear_error_measure();
  origin.set_build(build_description());
  origin.set_isa(rendering_isa());
  origin.set_mixed_builds(!same_bits_);
  return origin;
}

// Of a view that is rendered: its file, and the row that says so. What cannot be written now waits beside the
// checkpoints, so that it need not be rendered again.
std::optional<JobAttempt::Outcome> JobAttempt::write_view(std::uint32_t view, std::span<const std::uint8_t> bytes,
                                                          const std::string& frame_end) {
  Sha256 hash;
  hash.update(bytes);
  const Sha256Digest digest = hash.finish();
  auto file = place_of(view);
  // A kill between the file and its row would leave the job before a file that it does not know for its own, unless
  // the same bits come again.
  const bool guard = request_.has_output() && !request_.output().overwrite();
  if (guard) {
    if (const Status kept = keep_view(view, bytes, frame_end); !kept.ok()) note(kept.error().to_string());
  }
  Status written = file ? write_file(*file, bytes, digest) : Status(file.error());
  const bool has_file = written.ok();
  if (has_file) {
    JobResult result;
    result.view = view;
    result.frame_end = frame_end;
    result.file = *file;
    result.bytes = bytes.size();
    result.sha256 = to_hex(digest);
    written = stores_.table.add_result(record_.id, result);
  }
  if (written.ok()) {
    record_.views_done = view + 1;
    return std::nullopt;
  }
  std::string reason = fmt::format("view {} is rendered, and {} could not be written: {}", view,
                                   has_file ? "its row" : "its file", written.error().to_string());
  const Status kept = guard ? ok_status() : keep_view(view, bytes, frame_end);
  if (!kept.ok()) reason += "; nor kept: " + kept.error().to_string();
  // Its row alone is lacking: nobody but the database has anything to do.
  if (has_file && written.error().code == ErrorCode::unavailable) return failed({ErrorCode::unavailable, reason, {}});
  return paused(std::move(reason));
}

// A finished view waits in a file of its job's checkpoints.
Status JobAttempt::keep_view(std::uint32_t view, std::span<const std::uint8_t> bytes, const std::string& frame_end) {
  const CheckpointHeader header{view, build_, same_bits_, frame_end};
  const std::span<const std::uint8_t> body[] = {bytes};
  return stores_.checkpoints.write(record_.id, header.write(), body);
}

Result<std::string> JobAttempt::place_of(std::uint32_t view) const {
  if (request_.has_output()) return stores_.outputs.file_of(request_.output().path(), view, "output.path");
  const std::string folder = result_folder(stores_.results, record_.id);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{ErrorCode::unavailable, "cannot be made: " + error.message(), folder};
  return fmt::format("{}/{}.exr", folder, view);
}

Status JobAttempt::write_file(const std::string& file, std::span<const std::uint8_t> bytes,
                              const Sha256Digest& digest) const {
  if (!request_.has_output()) return write_file_atomically(file, bytes);
  const bool overwrite = request_.output().overwrite();
  std::error_code error;
  if (!overwrite && std::filesystem::is_regular_file(std::filesystem::symlink_status(file, error))) {
    const auto there = hash_file(file);
    if (there && there->sha256 == digest) return ok_status();  // an attempt wrote it, and ended before it could say so
  }
  const Status written = stores_.outputs.write(file, bytes, overwrite);
  if (!written.ok() && written.error().code == ErrorCode::failed_precondition)
    return Error{ErrorCode::failed_precondition, "is there already, and overwrite is not set", file};
  return written;
}

std::optional<JobAttempt::Outcome> JobAttempt::asked_to_stop() const {
  const std::lock_guard lock(signals_->mutex);
  if (signals_->asked == Request::none) return std::nullopt;
  return stopped(signals_->asked, signals_->asked_by);
}

JobAttempt::Outcome JobAttempt::stopped(Request request, const std::string& by) {
  Outcome outcome;
  outcome.change.by = by;
  outcome.change.to = request == Request::cancel  ? JobState::canceled
                      : request == Request::pause ? JobState::paused
                                                  : JobState::queued;
  if (request == Request::suspend) outcome.change.reason = "the daemon stopped";
  return outcome;
}

}  // namespace helio
