#include "server/rpc/job_streams.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <deque>
#include <utility>

#include "renderer/base/clock.h"
#include "server/base/grpc_status.h"
#include "server/base/retry.h"
#include "server/jobs/job_messages.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"

namespace helio {
namespace {

constexpr double kProgressInterval = 0.25;  // seconds
constexpr int kEventsAtATime = 64;
constexpr std::size_t kChunk = 1 << 20;  // bytes

// Follows a job, or all of them, from one event to the next, and running ones' progress in between.
class JobFollower {
 public:
  // job_id: empty, all. progress: of running ones, too.
  JobFollower(ServiceCore& core, DurableJobs& jobs, std::string job_id, bool progress,
              const std::weak_ptr<PulledStream::Waker>& waker)
      : core_(core), jobs_(jobs), job_id_(std::move(job_id)), progress_(progress), waker_(waker) {
    listener_ = jobs.listen([waker] {
      if (const auto stream = waker.lock()) stream->wake();
    });
  }

  // Events from `seq` on; 0: from now on. The next one's number.
  Result<std::uint64_t> begin(std::uint64_t seq) {
    const auto next = jobs_.table().next_seq();
    if (!next) return next.error();
    if (seq > *next) {
      return Error{ErrorCode::invalid_argument, fmt::format("{}; allowed: [1, {}], or 0", seq, *next), "from_seq"};
    }
    seq_ = seq == 0 ? *next : seq;
    return *next;
  }

  // The next event; nothing: there is none yet.
  Result<std::optional<JobEvent>> next_event() {
    if (events_.empty()) {
      auto events = jobs_.table().events(job_id_, seq_, kEventsAtATime);
      if (!events) return events.error();
      events_.assign(std::make_move_iterator(events->begin()), std::make_move_iterator(events->end()));
    }
    if (events_.empty()) return std::optional<JobEvent>();
    JobEvent event = std::move(events_.front());
    events_.pop_front();
    seq_ = event.seq + 1;
    return std::optional(std::move(event));
  }

  // A running job's progress that was not told yet, at most every kProgressInterval; nothing: none is due.
  Result<std::optional<pb::Job>> next_progress() {
    if (!progress_) return std::optional<pb::Job>();
    if (due_.empty() && now_s() >= next_look_s_) {
      auto running = look();
      if (!running) return running.error();
      for (JobRecord& record : *running) {
        pb::Job job = jobs_.describe(record);
        // What a checkpoint tells before the attempt renders has no rate, and is no news.
        if (job.progress().samples_per_second() > 0) due_.push_back(std::move(job));
      }
      next_look_s_ = now_s() + kProgressInterval;
      core_.timers.call_at(next_look_s_, [waker = waker_] {
        if (const auto stream = waker.lock()) stream->wake();
      });
    }
    if (due_.empty()) return std::optional<pb::Job>();
    pb::Job job = std::move(due_.front());
    due_.pop_front();
    return std::optional(std::move(job));
  }

 private:
  Result<std::vector<JobRecord>> look() const {
    if (job_id_.empty()) return jobs_.table().in_state(JobState::running);
    auto record = jobs_.table().get(job_id_);
    if (!record) return record.error();
    std::vector<JobRecord> running;
    if (record->state == JobState::running) running.push_back(std::move(*record));
    return running;
  }

  ServiceCore& core_;
  DurableJobs& jobs_;
  const std::string job_id_;
  const bool progress_;
  const std::weak_ptr<PulledStream::Waker> waker_;
  DurableJobs::Listener listener_;
  std::uint64_t seq_ = 0;
  std::deque<JobEvent> events_;
  std::deque<pb::Job> due_;
  double next_look_s_ = 0;
};

MessageSource::Next message(const google::protobuf::MessageLite& what) {
  MessageSource::Next next;
  next.message = to_bytes(what);
  return next;
}

MessageSource::Next over(grpc::Status status = grpc::Status::OK) {
  MessageSource::Next next;
  next.end = std::move(status);
  return next;
}

// A daemon that stops ends the call once everything is told.
MessageSource::Next nothing_yet(const ServiceCore& core, const DurableJobs& jobs) {
  if (jobs.closed()) return over(to_grpc_status(core.check_accepting()));
  return {};
}

class Watch final : public MessageSource {
 public:
  Watch(ServiceCore& core, DurableJobs& jobs, const pb::WatchJobRequest& request,
        const std::weak_ptr<PulledStream::Waker>& waker)
      : core_(core), jobs_(jobs), request_(request), follower_(core, jobs, request.job_id(), request.progress(), waker) {}

  Result<Next> next() override {
    if (!begun_) return begin();
    auto event = follower_.next_event();
    if (!event) return event.error();
    pb::WatchJobResponse response;
    if (*event) {
      *response.mutable_event() = to_message(**event);
      over_ = !request_.job_id().empty() && is_final((*event)->to);
      return message(response);
    }
    if (over_) return over();
    auto progress = follower_.next_progress();
    if (!progress) return progress.error();
    if (!*progress) return nothing_yet(core_, jobs_);
    *response.mutable_progress() = std::move(**progress);
    return message(response);
  }

 private:
  Result<Next> begin() {
    const auto next_seq = follower_.begin(request_.from_seq());
    if (!next_seq) return next_seq.error();
    pb::WatchJobResponse response;
    response.mutable_watching()->set_next_seq(*next_seq);
    if (!request_.job_id().empty()) {
      const auto job = jobs_.table().get(request_.job_id());
      if (!job) return job.error();
      over_ = is_final(job->state);
      *response.mutable_watching()->mutable_job() = jobs_.describe(*job);
    }
    begun_ = true;
    return message(response);
  }

  ServiceCore& core_;
  DurableJobs& jobs_;
  const pb::WatchJobRequest request_;
  JobFollower follower_;
  bool begun_ = false;
  bool over_ = false;  // the job has come to its end
};

class ResultFile final : public MessageSource {
 public:
  ResultFile(ServiceCore& core, DurableJobs& jobs, const pb::GetResultRequest& request)
      : core_(core), jobs_(jobs), request_(request) {}

  Result<Next> next() override {
    if (jobs_.closed()) return over(to_grpc_status(core_.check_accepting()));
    pb::GetResultResponse response;
    if (!file_) {
      auto result = jobs_.result(request_.job_id(), request_.view());
      if (!result) return result.error();
      file_ = jobs_.open(*result);
      if (!file_) return Error{ErrorCode::not_found, "'" + result->file + "' is gone, or cannot be read", "view"};
      left_ = result->view.bytes();
      *response.mutable_begin() = std::move(result->view);
      return message(response);
    }
    if (left_ == 0) return over();
    std::string chunk(std::size_t(std::min<std::uint64_t>(left_, kChunk)), '\0');
    if (!read_whole(chunk))
      return Error{ErrorCode::not_found, "its file has become shorter, or cannot be read", "view"};
    left_ -= chunk.size();
    response.set_data(std::move(chunk));
    return message(response);
  }

 private:
  bool read_whole(std::string& chunk) const {
    for (std::size_t have = 0; have < chunk.size();) {
      const ssize_t got = ::read(file_.get(), chunk.data() + have, chunk.size() - have);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      have += std::size_t(got);
    }
    return true;
  }

  ServiceCore& core_;
  DurableJobs& jobs_;
  const pb::GetResultRequest request_;
  FileDescriptor file_;
  std::uint64_t left_ = 0;
};

// The picture of a view, tile by tile: each is made when the one before is on its way.
class ResultTiles final : public MessageSource {
 public:
  ResultTiles(DurableJobs& jobs, const pb::GetResultRequest& request, CallerPtr caller)
      : jobs_(jobs), request_(request), caller_(std::move(caller)) {}

  Result<Next> next() override {
    pb::GetResultResponse response;
    if (!tiles_) {
      auto result = jobs_.tiles(request_, *caller_);
      if (!result) return result.error();
      tiles_ = std::move(result->tiles);
      *response.mutable_begin() = std::move(result->view);
      samples_ = response.begin().end().totals().samples_per_pixel();
      return message(response);
    }
    auto tile = tiles_->next();
    if (!tile) return tile.error();
    if (!*tile) return over();
    (*tile)->samples_per_pixel = samples_;
    *response.mutable_tile() = to_message(**tile, request_.job_id());
    response.mutable_tile()->set_exr((*tile)->bytes.data(), (*tile)->bytes.size());
    return message(response);
  }

 private:
  DurableJobs& jobs_;
  const pb::GetResultRequest request_;
  const CallerPtr caller_;
  std::optional<JobTiles> tiles_;
  std::uint32_t samples_ = 0;
};

// Accepted, progress, the result of every view, the last one's as the job's.
class DetachedJob final : public MessageSource {
 public:
  DetachedJob(ServiceCore& core, DurableJobs& jobs, pb::Job job, pb::RunJobResponse accepted,
              const std::weak_ptr<PulledStream::Waker>& waker)
      : core_(core), jobs_(jobs), job_(std::move(job)), follower_(core, jobs, job_.job_id(), true, waker) {
    responses_.push_back(std::move(accepted));
  }

  Status begin() {
    const auto begun = follower_.begin(job_.updated_seq());
    return begun ? ok_status() : Status(begun.error());
  }

  Result<Next> next() override {
    if (responses_.empty() && over_) return over();
    if (responses_.empty()) {
      if (const Status told = collect(); !told.ok()) return told.error();
    }
    if (responses_.empty()) return nothing_yet(core_, jobs_);
    const pb::RunJobResponse response = std::move(responses_.front());
    responses_.pop_front();
    return message(response);
  }

 private:
  Status collect() {
    auto event = follower_.next_event();
    if (!event) return event.error();
    const bool final = *event && is_final((*event)->to);
    std::optional<pb::Job> progress;
    if (!final) {
      auto due = follower_.next_progress();
      if (!due) return due.error();
      progress = std::move(*due);
    }
    if (final || (progress && progress->views_done() > told_)) {
      const auto job = jobs_.get(job_.job_id());
      if (!job) return job.error();
      for (; told_ < std::uint32_t(job->results_size()); ++told_) tell(job->results(int(told_)));
    }
    if (final) {
      over_ = true;
      if ((*event)->to != JobState::succeeded) tell_end(**event);
    } else if (progress) {
      *responses_.emplace_back().mutable_progress() = progress->progress();
    }
    return ok_status();
  }

  void tell(const pb::JobView& view) {
    pb::RunJobResponse& response = responses_.emplace_back();
    if (view.view() + 1 < job_.views()) {
      response.mutable_view_result()->set_job_id(job_.job_id());
      response.mutable_view_result()->set_view(view.view());
      *response.mutable_view_result()->mutable_end() = view.end();
      return;
    }
    response.mutable_result()->set_job_id(job_.job_id());
    response.mutable_result()->set_view(view.view());
    *response.mutable_result()->mutable_end() = view.end();
  }

  void tell_end(const JobEvent& event) {
    pb::RunJobResponse::Result& result = *responses_.emplace_back().mutable_result();
    result.set_job_id(job_.job_id());
    result.set_view(told_);
    result.mutable_end()->set_reason(event.to == JobState::canceled ? pb::END_REASON_CANCELLED
                                                                    : pb::END_REASON_FAILED);
    result.mutable_end()->set_message(event.reason);
  }

  ServiceCore& core_;
  DurableJobs& jobs_;
  const pb::Job job_;
  JobFollower follower_;
  std::deque<pb::RunJobResponse> responses_;
  std::uint32_t told_ = 0;  // views
  bool over_ = false;
};

}  // namespace

PulledStream::Make watch_job(ServiceCore& core, DurableJobs& jobs, pb::WatchJobRequest request) {
  return [&core, &jobs, request = std::move(request)](
             std::weak_ptr<PulledStream::Waker> waker) -> Result<std::unique_ptr<MessageSource>> {
    return std::unique_ptr<MessageSource>(std::make_unique<Watch>(core, jobs, request, waker));
  };
}

PulledStream::Make get_result(ServiceCore& core, DurableJobs& jobs, pb::GetResultRequest request, CallerPtr caller) {
  return [&core, &jobs, request = std::move(request),
          caller = std::move(caller)](const auto&) -> Result<std::unique_ptr<MessageSource>> {
    if (request.has_tiles())
      return std::unique_ptr<MessageSource>(std::make_unique<ResultTiles>(jobs, request, caller));
    return std::unique_ptr<MessageSource>(std::make_unique<ResultFile>(core, jobs, request));
  };
}

PulledStream::Make run_detached_job(ServiceCore& core, DurableJobs& jobs, pb::RunJobRequest request, CallerPtr caller,
                                    std::string by) {
  return [&core, &jobs, request = std::move(request), caller = std::move(caller),
          by = std::move(by)](std::weak_ptr<PulledStream::Waker> waker) -> Result<std::unique_ptr<MessageSource>> {
    pb::SubmitJobRequest submit;
    *submit.mutable_job() = request;
    submit.mutable_job()->clear_detach();
    auto submitted = jobs.submit(submit, *caller, by);
    if (!submitted) return submitted.error();
    const pb::Job& job = submitted->job();
    pb::RunJobResponse response;
    pb::RunJobResponse::Accepted& accepted = *response.mutable_accepted();
    accepted.set_job_id(job.job_id());
    *accepted.mutable_settings() = job.settings();
    accepted.set_views(job.views());
    accepted.mutable_unsampled()->Swap(submitted->mutable_unsampled());
    accepted.mutable_notices()->Swap(submitted->mutable_notices());
    auto detached = std::make_unique<DetachedJob>(core, jobs, job, std::move(response), waker);
    if (const Status begun = detached->begin(); !begun.ok()) return begun.error();
    return std::unique_ptr<MessageSource>(std::move(detached));
  };
}

}  // namespace helio
