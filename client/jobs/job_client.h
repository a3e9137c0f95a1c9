// Jobs that a daemon keeps (proto/heliograph/v1/durable_job.proto): they outlive the call that submitted them, the
// client and the daemon itself. A class of its own beside RenderClient, on the same channel: who looks after jobs needs
// neither scenes nor frames.
//
//   JobClient jobs(*client);
//   auto submitted = jobs.submit(request);
//   auto watched = jobs.watch(follow, {.job = show});
//   auto file = jobs.fetch(submitted->job().job_id(), 0, "room.exr");
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/call_control.h"
#include "client/render_client.h"
#include "heliograph/v1/durable_job.pb.h"
#include "renderer/base/result.h"

namespace helio {

// Called on the thread of watch(), in the order of arrival; empty ones are skipped.
struct JobWatchCallbacks {
  // Once, first: the watched job as it is, and the number of the next event that will come to be.
  std::function<void(const heliograph::v1::WatchJobResponse::Watching&)> watching;
  std::function<void(const heliograph::v1::JobEvent&)> event;
  std::function<void(const heliograph::v1::Job&)> progress;
};

// Nothing will change any more.
bool is_over(heliograph::v1::JobState state);

// Thread safe; blocking. Errors as of RenderClient; besides, of all: unimplemented (the daemon is older than jobs that
// it keeps), failed_precondition (it keeps none: it has no state folder).
class JobClient {
 public:
  explicit JobClient(const RenderClient& client) : link_(client.link()) {}

  Result<heliograph::v1::SubmitJobResponse> submit(const heliograph::v1::SubmitJobRequest& request,
                                                   CallControl* control = nullptr);
  Result<heliograph::v1::ListJobsResponse> list(const heliograph::v1::ListJobsRequest& request);
  Result<heliograph::v1::Job> get(const std::string& job_id);  // with its results
  // Blocks until the job has come to its end, or `control` ends the watch (cancelled), which the job does not notice.
  Status watch(const heliograph::v1::WatchJobRequest& request, const JobWatchCallbacks& callbacks,
               CallControl* control = nullptr);
  Result<heliograph::v1::Job> pause(const std::string& job_id);
  Result<heliograph::v1::Job> resume(const std::string& job_id);
  Result<heliograph::v1::Job> set_priority(const std::string& job_id, int priority);  // [-100, 100]
  Status cancel(const std::string& job_id);                                           // also of RunJob

  // Writes the EXR file of a view that is done to `path`, whole or not at all, once its length and SHA-256 are right.
  // `received`: bytes so far and in total.
  Result<heliograph::v1::JobView> fetch(const std::string& job_id, std::uint32_t view, const std::string& path,
                                        const std::function<void(std::uint64_t, std::uint64_t)>& received = {},
                                        CallControl* control = nullptr);

  // The picture of a view as tiles, of one that is done or of the newest checkpoint of the one in hand: for a
  // FrameAssembler that was begun with the job's settings, and the window as their region.
  Result<heliograph::v1::JobView> tiles(const heliograph::v1::GetResultRequest& request,
                                        const std::function<void(heliograph::v1::Tile)>& tile,
                                        CallControl* control = nullptr);

  // The id that begins so. not_found; invalid_argument: several do, named with what tells them apart.
  Result<std::string> find(const std::string& prefix);

 private:
  template <class Request, class Response>
  Result<Response> call(grpc::Status (ServiceLink::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        const Request& request, CallControl* control = nullptr) const;

  std::shared_ptr<const ServiceLink> link_;
};

}  // namespace helio
