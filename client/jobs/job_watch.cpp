#include "client/jobs/job_watch.h"

#include <chrono>
#include <optional>
#include <thread>

#include "renderer/base/clock.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr double kAgainSeconds = 0.25;

}  // namespace

Status JobWatch::run(const JobWatchCallbacks& callbacks, CallControl& control,
                     const std::function<void(const Error&)>& lost) {
  pb::WatchJobRequest request;
  request.set_job_id(job_id_);
  request.set_progress(bool(callbacks.progress));
  bool begun = false, over = false;
  std::optional<double> lost_s;  // since when
  JobWatchCallbacks mine = callbacks;
  mine.watching = [&](const pb::WatchJobResponse::Watching& watching) {
    lost_s.reset();
    over = is_over(watching.job().state());
    if (request.from_seq() == 0) request.set_from_seq(watching.next_seq());
    if (!begun && callbacks.watching) callbacks.watching(watching);
    begun = true;
  };
  mine.event = [&](const pb::JobEvent& event) {
    over = is_over(event.to());
    request.set_from_seq(event.seq() + 1);
    if (callbacks.event) callbacks.event(event);
  };
  for (;;) {
    const Status ended = jobs_.watch(request, mine, &control);
    // A job that has ended has been told of whole, even if the daemon went away before it could end the call.
    if (ended || over) return over ? ok_status() : Error{ErrorCode::unavailable, "the server ended the watch", {}};
    if (ended.error().code != ErrorCode::unavailable || wait_s_ <= 0) return ended;
    const double now = now_s();
    if (!lost_s && lost) lost(ended.error());
    if (!lost_s) lost_s = now;
    if (now > *lost_s + wait_s_) return ended;
    std::this_thread::sleep_for(std::chrono::duration<double>(kAgainSeconds));
    if (control.cancelled()) return Error{ErrorCode::cancelled, "cancelled", {}};
  }
}

}  // namespace helio
