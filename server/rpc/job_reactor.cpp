#include "server/rpc/job_reactor.h"

#include <spdlog/spdlog.h>

#include <string>
#include <variant>

#include "renderer/base/clock.h"
#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/log_format.h"
#include "server/base/parse_message.h"
#include "server/jobs/job_plan.h"
#include "server/rpc/call_rights.h"
#include "server/rpc/ended_by_reload.h"
#include "server/stream/convert.h"
#include "server/stream/owned_message.h"
#include "server/stream/stream_messages.h"

namespace helio {
JobReactor::JobReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
                       const grpc::ByteBuffer& request)
    : core_(core), caller_(std::move(caller)), began_s_(now_s()) {
  stream_ = std::make_shared<OutboundStream>(
      static_cast<OutboundStream::Call&>(*this), [this](Outbound message) { return encode(std::move(message)); },
      core.timers, &core.counters.streams);
  under_way_ = core.access.begin(caller_, end_of(stream_));
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
  auto planned = plan_job(core_, request, "");
  if (!planned) return planned.error();
  JobPlan& plan = planned->plan;
  const RenderSettings& settings = plan.settings;

  auto id = core_.job_quota.add(*caller_, [&] { return core_.jobs.reserve(caller_->name); });
  if (!id) return id.error();
  job_id_ = std::move(*id);
  const auto tiles = request.preview_tiles() ? FramePublisher::Tiles::all : FramePublisher::Tiles::final_only;
  auto rendering = RenderContext::create(core_.resources(*caller_), std::move(planned->scene),
                                         settings, plan.budget, RenderRank::job, tiles, plan.format.channels);
  if (!rendering) return rendering.error();
  auto queue = (*rendering)->reserve_queue(settings, plan.format);
  if (const Status fits = (*rendering)->keep_queue(std::move(queue), settings, plan.format); !fits.ok()) return fits;
  const JobNotices notices = notices_of(plan, (*rendering)->scene().snapshot->features());
  auto job = std::make_shared<Job>(job_id_, std::move(*rendering), std::move(plan.views));
  {
    const std::lock_guard lock(job_mutex_);
    if (cancelled_) return Error{ErrorCode::cancelled, "the caller gave up", {}};
    job_ = job;
  }
  pb::RunJobResponse::Accepted accepted;
  accepted.set_job_id(job_id_);
  *accepted.mutable_settings() = to_message(settings);
  accepted.set_views(static_cast<std::uint32_t>(job->views().size()));
  accepted.mutable_unsampled()->Add(notices.unsampled.begin(), notices.unsampled.end());
  accepted.mutable_notices()->Add(notices.notices.begin(), notices.notices.end());
  pb::RunJobResponse greeting;
  greeting.set_allocated_accepted(owned_message(std::move(accepted)));
  stream_->queue().limit_rate(plan.budget.bytes_per_second);
  // Attached before the greeting is sent: whoever has it may cancel the job at once, and is told of its end.
  RenderContext& rendering_of_job = job->rendering();
  rendering_of_job.publisher().attach(stream_, plan.format);
  core_.jobs.add(job);  // attached: who ends all jobs ends this call
  stream_->push(Greeting{greeting.SerializeAsString()});
  job->start_view();
  rendering_of_job.report_progress(stream_);
  spdlog::info("job accepted job={} scene={} size={}x{} views={} peer={}{}", job_id_,
               rendering_of_job.scene().id.substr(0, 12), settings.width, settings.height, job->views().size(),
               logged(context.peer()), caller_->name.empty() ? "" : " by=" + caller_->name);
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
  if (result_sent_) reason_ = reason;
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
    spdlog::info("job over job={} reason={} seconds={:.3f}", job_id_, to_string(reason_.load()), now_s() - began_s_);
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
