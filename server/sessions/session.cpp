#include "server/sessions/session.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "renderer/base/clock.h"
#include "server/stream/owned_message.h"

namespace helio {
namespace {

constexpr double kAttached = -1;
constexpr double kRestartSeconds = 1;  // after which a daemon that restarts may be asked again

}  // namespace

Session::Session(std::string id, std::shared_ptr<RenderContext> rendering, const RenderSettings& settings,
                 const Budget& budget, unsigned channels, double grace_s, const RenderLimits& limits, std::string owner)
    : id_(std::move(id)),
      owner_(std::move(owner)),
      grace_s_(grace_s),
      limits_(limits),
      rendering_(std::move(rendering)),
      settings_(settings),
      budget_(budget),
      channels_(channels),
      idle_since_s_(now_s()) {}

RenderSettings Session::settings() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

// Keeps close_idle() away while the mutex is let go of.
class Session::InUse {
 public:
  InUse(int& count, std::unique_lock<std::mutex>& lock) : count_(count), lock_(lock) { ++count_; }
  InUse(const InUse&) = delete;
  ~InUse() {
    if (!lock_.owns_lock()) lock_.lock();
    --count_;
  }

 private:
  int& count_;
  std::unique_lock<std::mutex>& lock_;
};

Error Session::gone() const {
  return {ErrorCode::not_found, "there is no session '" + id_ + "'", "session_id"};
}

Error Session::draining() const {
  return {ErrorCode::unavailable, "the daemon is draining", {}, kRestartSeconds};
}

Status Session::read(const Change& change, RenderLoop::Update& update) const {
  if (closed_) return gone();
  if (frozen_) return draining();
  Problems problems;
  if (change.view) {
    const LoadedScene& scene = change.scene ? **change.scene : rendering_->scene();
    const ViewRules rules{&scene.snapshot->description().cameras, scene.manifest.time_s, last_view_id_};
    update.view = read_view(*change.view, rules, "view", problems);
  }
  if (change.settings) update.settings = read_settings(*change.settings, limits_, "settings", problems);
  if (change.budget) update.budget = read_budget(*change.budget, "budget", problems);
  if (!problems.empty()) return problems.to_error();
  if (!update.settings) return ok_status();
  return check_film_size(*update.settings, limits_, "settings");
}

Result<std::uint64_t> Session::move_gaze(const pb::StreamRequest::MoveGaze& message) {
  Problems problems;
  const std::optional<Gaze> gaze = read_gaze(message, "gaze", problems);
  if (!problems.empty()) return problems.to_error();
  const std::lock_guard lock(mutex_);
  if (closed_) return gone();
  if (frozen_) return draining();
  if (view_) view_->gaze = gaze;
  rendering_->loop().move_gaze(gaze);
  return rendering_->loop().revision();
}

// Another rate and nothing else: the frame in flight goes on.
bool Session::changes_rate_alone(const Change& change, const RenderLoop::Update& update) const {
  if (!update.budget || change.view || change.settings || change.scene || paused_) return false;
  Budget same = *update.budget;
  same.bytes_per_second = budget_.bytes_per_second;
  return same == budget_ && update.budget->bytes_per_second != budget_.bytes_per_second;
}

Result<std::uint64_t> Session::update(const Change& change) {
  if (change.gaze && !change.view && !change.settings && !change.budget && !change.scene)
    return move_gaze(*change.gaze);
  RenderLoop::Update update;
  std::unique_lock resizing(resize_mutex_, std::defer_lock);
  if (change.settings || change.scene) resizing.lock();
  std::unique_lock lock(mutex_);
  if (const Status usable = read(change, update); !usable.ok()) return usable.error();
  const InUse in_use(in_use_, lock);
  const RenderSettings wanted = update.settings.value_or(settings_);
  const bool on_device = wanted.device.kind != RenderDevice::Kind::cpu;
  if (update.settings || (change.scene && on_device)) {
    const bool listened = rendering_->publisher().stream() != nullptr;
    const TileFormat format = format_;
    const unsigned channels = channels_;
    lock.unlock();
    Status fits =
        rendering_->place(wanted.device, change.scene ? (*change.scene)->snapshot : rendering_->scene().snapshot);
    if (fits.ok() && update.settings) fits = rendering_->prepare(wanted, channels, update);
    Result<Reservation> queue = Reservation();
    if (fits.ok() && update.settings && listened) queue = rendering_->reserve_queue(wanted, format);
    lock.lock();
    if (!fits.ok()) return fits.error();
    // Meanwhile the session may have been closed, have got a newer view, or have lost its listener.
    if (const Status usable = read(change, update); !usable.ok()) return usable.error();
    if (update.settings && rendering_->publisher().stream()) {
      const Status kept = rendering_->keep_queue(std::move(queue), *update.settings, format_);
      if (!kept.ok()) return kept.error();
    }
  }

  if (changes_rate_alone(change, update)) {
    budget_ = *update.budget;
    rendering_->loop().set_rate(budget_.bytes_per_second);
    if (const auto stream = rendering_->publisher().stream()) {
      stream->queue().limit_rate(budget_.bytes_per_second);
      stream->kick();
    }
    return rendering_->loop().revision();
  }

  // May throw when memory is out; nothing has changed then.
  const std::uint64_t revision =
      change.scene ? rendering_->switch_scene(std::move(*change.scene), update) : rendering_->loop().update(update);
  if (update.settings) {
    if (settings_.device != update.settings->device) rendering_->publisher().tell("");
    settings_ = *update.settings;
    if (settings_.device.kind == RenderDevice::Kind::cpu) rendering_->release_device();
  }
  if (update.budget) budget_ = *update.budget;
  if (update.view) {
    last_view_id_ = update.view->id;
    restored_ = restored_ && view_ && view_->camera == update.view->camera;
    view_ = update.view;
  }
  if (update.settings || change.scene) restored_ = false;
  const auto stream = rendering_->publisher().stream();
  if (stream) {
    stream->queue().drop_before(revision);
    if (update.budget) stream->queue().limit_rate(budget_.bytes_per_second);
    stream->kick();
  }
  paused_ = false;
  if (!stream && !bounded()) pause();
  if (!stream) idle_since_s_ = now_s();
  return revision;
}

Status Session::attach(const std::shared_ptr<OutboundStream>& stream, const TileFormat& format, TakeOver take_over) {
  const auto may_attach = [&]() -> Status {
    if (closed_) return gone();
    if (frozen_) return draining();
    if (take_over == TakeOver::yes || !rendering_->publisher().stream()) return ok_status();
    return Error{
        ErrorCode::permission_denied,
        "session '" + id_ + "' has a listener, and a stream of another token may not take it over; this needs admin",
        "session_id"};
  };
  const std::lock_guard resizing(resize_mutex_);
  std::unique_lock lock(mutex_);
  if (const Status may = may_attach(); !may.ok()) return may;
  const InUse in_use(in_use_, lock);
  const RenderSettings settings = settings_;
  lock.unlock();
  RenderLoop::Update go_on;
  const Status fits = rendering_->prepare_display(settings, format.channels, go_on);
  auto queue = rendering_->reserve_queue(settings, format);
  lock.lock();
  if (!fits.ok()) return fits.error();
  // Meanwhile it may have been closed, or have got a listener; its size stays while this has resize_mutex_.
  if (const Status may = may_attach(); !may.ok()) return may;
  if (const Status kept = rendering_->keep_queue(std::move(queue), settings_, format); !kept.ok()) return kept;
  RenderLoop& loop = rendering_->loop();
  const bool has_samples = loop.progress().trace.paths > 0;

  pb::Opened opened;
  opened.set_session_id(id_);
  opened.set_revision(loop.revision());
  *opened.mutable_settings() = to_message(settings_);
  *opened.mutable_budget() = to_message(budget_);
  opened.set_resumed(has_samples || restored_);
  opened.set_scene_id(rendering_->scene().id);
  opened.set_view_id(last_view_id_);
  pb::StreamResponse greeting;
  greeting.set_allocated_opened(owned_message(std::move(opened)));
  stream->queue().limit_rate(budget_.bytes_per_second);
  stream->push(Greeting{greeting.SerializeAsString()});
  if (!told_.empty()) stream->push(Notice{NoticeSeverity::warning, std::exchange(told_, {})});

  stream->queue().drop_before(loop.revision());
  const bool was_over = frame_over();
  const auto before = rendering_->publisher().attach(stream, format);
  idle_since_s_ = kAttached;
  format_ = format;
  if (before) {
    before->finish({grpc::StatusCode::ABORTED, "another stream took session '" + id_ + "' over"});
    spdlog::info("session taken over session={}", id_);
  }
  // The film is kept: its newest state is shown at once, and a frame that has not come to its end goes on.
  if (paused_ || channels_ != format.channels) {
    if (paused_ || !was_over) go_on.budget = budget_;
    go_on.channels = channels_ = format.channels;
    loop.update(go_on);
    paused_ = false;
  } else {
    if (was_over && has_samples) rendering_->publisher().forget_end();
    loop.republish();
  }
  rendering_->report_progress(stream);
  return ok_status();
}

void Session::detach(const OutboundStream* stream) {
  const std::lock_guard lock(mutex_);
  if (!rendering_->publisher().detach(stream)) return;
  idle_since_s_ = now_s();
  rendering_->release_queue();
  if (!frozen_ && !frame_over()) pause();
}

void Session::finish_after_frame(const std::shared_ptr<OutboundStream>& stream) {
  const std::lock_guard lock(mutex_);
  if (rendering_->publisher().stream() != stream) return;
  if (last_view_id_ == 0 || !bounded()) {
    stream->finish_when_drained(grpc::Status::OK);
  } else {
    rendering_->publisher().finish_after(rendering_->loop().revision());
  }
}

void Session::drain(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  const auto stream = rendering_->publisher().stream();
  if (stream) stream->push(Notice{NoticeSeverity::draining, status.error_message()});
  rendering_->loop().cancel();
  rendering_->publisher().finish_cancelled(status, /*tell=*/false);
}

void Session::freeze(const std::string& notice) {
  const std::lock_guard lock(mutex_);
  if (frozen_) return;
  frozen_ = true;
  if (const auto stream = rendering_->publisher().stream()) stream->push(Notice{NoticeSeverity::draining, notice});
  rendering_->publisher().mute();
  rendering_->loop().cancel();
}

Session::State Session::state() const {
  const std::lock_guard lock(mutex_);
  return {settings_, budget_, view_, rendering_->publisher().stream() != nullptr};
}

Result<std::shared_ptr<const PictureCheckpoint>> Session::copy_picture(double deadline_s) {
  std::unique_lock lock(mutex_);
  const bool any = view_ && (restored_ || rendering_->loop().progress().trace.paths > 0);
  const RenderSettings settings = settings_;
  const Budget budget = budget_;
  lock.unlock();
  if (!any) return std::shared_ptr<const PictureCheckpoint>();
  return rendering_->copy_picture(settings, budget, deadline_s);
}

bool Session::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

SceneLease Session::lease() const {
  const std::lock_guard lock(mutex_);
  return SceneLease(rendering_->scene().shared_from_this());
}

void Session::end_stream(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  if (const auto stream = rendering_->publisher().stream()) stream->finish(status);
}

Status Session::take_up(const View& view, std::shared_ptr<const PictureCheckpoint> picture, std::string told) {
  const std::lock_guard lock(mutex_);
  const Status suits = picture ? picture->suits(settings_, view) : ok_status();
  RenderLoop::Update update;
  update.view = view;
  if (suits.ok()) update.resume = std::move(picture);
  restored_ = update.resume != nullptr;
  update.begin = false;
  if (rendering_->loop().update(update) == 0) restored_ = false;
  view_ = view;
  last_view_id_ = view.id;
  told_ = std::move(told);
  paused_ = true;
  return suits;
}

void Session::close(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  close_locked(status);
}

bool Session::close_idle(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  if (!idle_locked()) return false;
  close_locked(status);
  return true;
}

void Session::close_locked(const grpc::Status& status) {
  closed_ = true;
  rendering_->loop().cancel();
  if (const auto stream = rendering_->publisher().stream()) stream->finish(status);
}

pb::SessionInfo Session::info() const {
  const std::lock_guard lock(mutex_);
  const auto stream = rendering_->publisher().stream();
  pb::SessionInfo info;
  info.set_session_id(id_);
  info.set_scene_id(rendering_->scene().id);
  *info.mutable_settings() = to_message(settings_);
  info.set_revision(rendering_->loop().revision());
  info.set_attached(stream != nullptr);
  *info.mutable_progress() = to_message(rendering_->loop().progress(), id_);
  info.set_memory_bytes(rendering_->loop().memory_bytes() + (stream ? stream->queue().bytes() : 0));
  info.set_invalid_samples(rendering_->loop().invalid_samples());
  info.set_used_seconds(rendering_->loop().used_seconds());
  info.set_idle_s(idle_s());
  info.set_owner(owner_);
  return info;
}

std::uint64_t Session::idle_bytes() const {
  const std::lock_guard lock(mutex_);
  return idle_locked() ? film_bytes(settings_) + scratch_bytes(settings_) + preview_bytes(settings_) +
                             display_bytes(settings_, channels_)
                       : 0;
}

double Session::idle_s() const {
  const double since = idle_since_s_;
  return since == kAttached ? 0 : now_s() - since;
}

// Whether the newest revision's frame has ended by itself (or there is none).
bool Session::frame_over() const {
  if (last_view_id_ == 0) return true;
  const auto end = rendering_->publisher().last_end();
  return end && end->tag.revision >= rendering_->loop().revision();
}

void Session::pause() {
  if (last_view_id_ == 0) return;
  rendering_->loop().cancel();
  paused_ = true;
}

}  // namespace helio
