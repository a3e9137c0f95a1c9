#include "server/rpc/job_reactor.h"

#include <spdlog/spdlog.h>

#include <set>
#include <string>
#include <variant>
#include <vector>

#include "renderer/trace/selection/unsampled_light.h"
#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/stream/convert.h"
#include "server/stream/owned_message.h"
#include "server/stream/stream_messages.h"

namespace helio {
namespace {

constexpr int kMaxViews = 10000;

// The views to render, one for a still. Without a scene, cameras that are only named cannot be looked at.
std::vector<View> read_views(const pb::RunJobRequest& request, const LoadedScene* scene, Problems& problems) {
  static const std::vector<CameraDescription> kNone;
  const auto& cameras = scene ? scene->snapshot->description().cameras : kNone;
  std::vector<View> views;
  const auto add = [&](const CameraPose& pose) {
    View& view = views.emplace_back();
    view.id = views.size();
    view.time_s = scene ? scene->manifest.time_s : 0;
    view.camera = pose;
  };
  const auto read = [&](const pb::CameraView& camera, const std::string& where) {
    if (!scene && camera.orientation_case() == pb::CameraView::kSceneCamera) return;
    add(read_camera(camera, cameras, where, problems));
  };
  if (request.views_size() > kMaxViews) {
    problems.add("views", fmt::format("{} views; allowed: at most {}", request.views_size(), kMaxViews));
    return views;
  }
  if (request.views_size() > 0 && request.has_camera()) {
    problems.add("camera", "is given beside views; allowed: one of them");
  }
  for (int i = 0; i < request.views_size(); ++i) read(request.views(i), fmt::format("views[{}]", i));
  if (request.has_camera()) read(request.camera(), "camera");
  if (views.empty() && scene) add(camera_pose(cameras.front()));
  return views;
}

}  // namespace

JobReactor::JobReactor(ServiceCore& core, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request)
    : core_(core) {
  stream_ = std::make_shared<OutboundStream>(
      static_cast<OutboundStream::Call&>(*this), [this](Outbound message) { return encode(std::move(message)); },
      core.timers);
  start_later(context, request);
}

// On a thread that can take the time which a film takes to allocate.
void JobReactor::start_later(grpc::CallbackServerContext& context, const grpc::ByteBuffer& request) {
  if (!hold_.begin()) return;
  const Status taken = guarded([&]() -> Status {
    const auto parsed = make_arena_message<pb::RunJobRequest>();
    grpc::ByteBuffer copy(request);  // shares the slices
    if (const Status done = parse_message(copy, *parsed); !done.ok()) return done;
    const bool submitted = core_.thread_for(parsed->settings().device()).submit([this, &context, parsed] {
      const Status started = guarded([&] { return start(context, *parsed); });
      if (!started.ok()) stream_->finish(to_grpc_status(started));
      start_over();
    });
    if (submitted) return ok_status();
    return core_.too_many_waiting();
  });
  if (taken.ok()) return;
  stream_->finish(to_grpc_status(taken));
  start_over();
}

void JobReactor::start_over() {
  auto status = hold_.end([] {});
  if (status) Finish(*std::move(status));  // this may be gone now
}

Status JobReactor::start(grpc::CallbackServerContext& context, const pb::RunJobRequest& request) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  {
    const std::lock_guard lock(job_mutex_);
    if (cancelled_) return Error{ErrorCode::cancelled, "the caller gave up", {}};
  }
  tell_ignored(context, unknown_fields(request));
  Problems problems;
  check_id(request.scene_id(), "scene_id", problems);
  const bool id_usable = problems.empty();
  const RenderSettings settings = read_settings(request.settings(), core_.render_limits(), "settings", problems);
  if (settings.preview.rate > 0)
    problems.add("settings.preview_rate",
                 number_text(settings.preview.rate) + "; allowed: 0, for nobody drags the camera of a job");
  const Budget budget = read_budget(request.budget(), "budget", problems);
  if (!budget.time_s && !budget.samples && !budget.error) {
    problems.add("budget", "has no end; one of time_s, samples, error is required");
  }
  const TileFormat format = read_tile_format(request.format(), "format", problems, core_.oidn != nullptr);
  auto scene = core_.scenes.acquire(request.scene_id(), "scene_id");
  std::vector<View> views = read_views(request, scene ? &**scene : nullptr, problems);
  if (!problems.empty()) {
    if (!scene && id_usable) problems.add(scene.error().where, scene.error().message);
    return problems.to_error();
  }
  if (!scene) return scene.error();
  if (const Status fits = check_film_size(settings, core_.render_limits(), "settings"); !fits.ok()) return fits;

  auto id = core_.jobs.reserve();
  if (!id) return id.error();
  job_id_ = std::move(*id);
  const auto tiles = request.preview_tiles() ? FramePublisher::Tiles::all : FramePublisher::Tiles::final_only;
  auto rendering = RenderContext::create(core_.resources(), std::move(*scene), settings, budget, RenderRank::job, tiles,
                                         format.channels);
  if (!rendering) return rendering.error();
  auto queue = (*rendering)->reserve_queue(settings, format);
  if (const Status fits = (*rendering)->keep_queue(std::move(queue), settings, format); !fits.ok()) return fits;
  auto job = std::make_shared<Job>(job_id_, std::move(*rendering), std::move(views));
  {
    const std::lock_guard lock(job_mutex_);
    if (cancelled_) return Error{ErrorCode::cancelled, "the caller gave up", {}};
    job_ = job;
  }
  pb::RunJobResponse::Accepted accepted;
  accepted.set_job_id(job_id_);
  *accepted.mutable_settings() = to_message(settings);
  accepted.set_views(static_cast<std::uint32_t>(job->views().size()));
  const SceneFeatures& features = job->rendering().scene().snapshot->features();
  for (std::string& line : unsampled_light(settings.integrator, features)) {
    accepted.add_unsampled(std::move(line));
  }
  std::set<std::string> notices;
  for (const View& view : job->views()) notices.insert(aspect_notice(view.camera, settings.width, settings.height));
  for (const std::string& line : notices) {
    if (!line.empty()) accepted.add_notices(line);
  }
  pb::RunJobResponse greeting;
  greeting.set_allocated_accepted(owned_message(std::move(accepted)));
  stream_->queue().limit_rate(budget.bytes_per_second);
  // Attached before the greeting is sent: whoever has it may cancel the job at once, and is told of its end.
  RenderContext& rendering_of_job = job->rendering();
  rendering_of_job.publisher().attach(stream_, format);
  core_.jobs.add(job);  // attached: who ends all jobs ends this call
  stream_->push(Greeting{greeting.SerializeAsString()});
  job->start_view();
  rendering_of_job.report_progress(stream_);
  spdlog::info("job accepted id={} scene={} size={}x{} views={}", job_id_, rendering_of_job.scene().id.substr(0, 12),
               settings.width, settings.height, job->views().size());
  return ok_status();
}

grpc::ByteBuffer JobReactor::encode(Outbound message) {
  auto* report = std::get_if<FrameReport>(&message);
  if (!report) return to_job_response(std::move(message));
  const std::shared_ptr<Job> job = this->job();
  if (result_sent_ || !job) return {};
  FrameEndReason& reason = report->end.reason;
  const bool last = views_done_ + 1 == job->views().size();
  if (!last && job->stopped()) reason = FrameEndReason::cancelled;  // the view, not the job, has come to its end
  result_sent_ = last || reason == FrameEndReason::cancelled || reason == FrameEndReason::failed;
  grpc::ByteBuffer result =
      to_job_result(*report, job_id_, views_done_++, result_sent_, job->rendering().loop().invalid_samples());
  (result_sent_ ? end_due_ : view_due_) = true;
  return result;
}

// The next view starts when the end of the one before is on its way: no tile of that one waits any more. The job is
// released before the stream may finish the call.
void JobReactor::OnWriteDone(bool ok) {
  const bool ended = end_due_.exchange(false);
  if (ended) release_job();
  stream_->write_done(ok);
  if (view_due_.exchange(false) && ok) {
    const Status started = guarded([&] {
      if (const std::shared_ptr<Job> job = this->job()) job->start_view();
      return ok_status();
    });
    if (!started.ok()) stream_->finish(to_grpc_status(started));
  }
  if (ended) stream_->finish_when_drained(grpc::Status::OK);
}

std::shared_ptr<Job> JobReactor::job() {
  const std::lock_guard lock(job_mutex_);
  return job_;
}

void JobReactor::release_job() {
  std::shared_ptr<Job> job;
  {
    const std::lock_guard lock(job_mutex_);
    job = std::exchange(job_, nullptr);
  }
  if (job) {
    job->rendering().publisher().detach(stream_.get());
    spdlog::info("job over id={}", job_id_);
  }
  if (!job_id_.empty()) core_.jobs.remove(job_id_);
}

void JobReactor::OnCancel() {
  std::shared_ptr<Job> job;
  {
    const std::lock_guard lock(job_mutex_);
    cancelled_ = true;
    job = job_;
  }
  if (job) job->stop();
  stream_->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

void JobReactor::OnDone() {
  hold_.wait();
  release_job();
  delete this;
}

}  // namespace helio
