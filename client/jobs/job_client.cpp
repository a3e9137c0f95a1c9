#include "client/jobs/job_client.h"

#include <spdlog/fmt/fmt.h>

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "renderer/codec/atomic_file.h"
#include "renderer/codec/sha256.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

using Stub = ServiceLink::Stub;

constexpr int kPage = 1000;        // the protocol's largest
constexpr std::size_t kNamed = 5;  // ids of an ambiguous prefix that are told

std::span<const std::uint8_t> bytes_of(const std::string& data) {
  return {reinterpret_cast<const std::uint8_t*>(data.data()), data.size()};
}

// What gRPC says of a call that the server does not know is no help.
Error explain(Error error, const std::string& peer) {
  if (error.code != ErrorCode::unimplemented) return error;
  error.message = "the server at " + peer + " is older than this client and keeps no jobs";
  return error;
}

}  // namespace

bool is_over(pb::JobState state) {
  return state == pb::JOB_STATE_SUCCEEDED || state == pb::JOB_STATE_FAILED || state == pb::JOB_STATE_CANCELED;
}

template <class Request, class Response>
Result<Response> JobClient::call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                 const Request& request, CallControl* control) const {
  auto response = link_->call(method, request, control);
  if (!response) return explain(response.error(), link_->peer());
  return response;
}

Result<pb::SubmitJobResponse> JobClient::submit(const pb::SubmitJobRequest& request, CallControl* control) {
  return call(&Stub::SubmitJob, request, control);
}

Result<pb::ListJobsResponse> JobClient::list(const pb::ListJobsRequest& request) {
  return call(&Stub::ListJobs, request);
}

Result<pb::Job> JobClient::get(const std::string& job_id) {
  pb::GetJobRequest request;
  request.set_job_id(job_id);
  return call(&Stub::GetJob, request);
}

Status JobClient::watch(const pb::WatchJobRequest& request, const JobWatchCallbacks& callbacks, CallControl* control) {
  const auto take = [&](pb::WatchJobResponse& response) {
    if (response.has_watching() && callbacks.watching) callbacks.watching(response.watching());
    if (response.has_event() && callbacks.event) callbacks.event(response.event());
    if (response.has_progress() && callbacks.progress) callbacks.progress(response.progress());
    return ok_status();
  };
  const Status done = link_->read<pb::WatchJobRequest, pb::WatchJobResponse>(&Stub::WatchJob, request, take, control);
  if (!done) return explain(done.error(), link_->peer());
  return done;
}

Result<pb::Job> JobClient::pause(const std::string& job_id) {
  pb::PauseJobRequest request;
  request.set_job_id(job_id);
  return call(&Stub::PauseJob, request);
}

Result<pb::Job> JobClient::resume(const std::string& job_id) {
  pb::ResumeJobRequest request;
  request.set_job_id(job_id);
  return call(&Stub::ResumeJob, request);
}

Result<pb::Job> JobClient::set_priority(const std::string& job_id, int priority) {
  pb::SetJobPriorityRequest request;
  request.set_job_id(job_id);
  request.set_priority(priority);
  return call(&Stub::SetJobPriority, request);
}

Status JobClient::cancel(const std::string& job_id) {
  pb::CancelJobRequest request;
  request.set_job_id(job_id);
  const auto cancelled = link_->call(&Stub::CancelJob, request);
  if (!cancelled) return cancelled.error();
  return ok_status();
}

Result<pb::JobView> JobClient::fetch(const std::string& job_id, std::uint32_t view, const std::string& path,
                                     const std::function<void(std::uint64_t, std::uint64_t)>& received,
                                     CallControl* control) {
  pb::GetResultRequest request;
  request.set_job_id(job_id);
  request.set_view(view);
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  std::optional<pb::JobView> begin;
  Sha256 hash;
  std::uint64_t have = 0;
  const auto broken = [&](const std::string& what) {
    return Error{ErrorCode::internal, "the server at " + link_->peer() + " sent " + what,
                 "view " + std::to_string(view)};
  };
  const auto take = [&](pb::GetResultResponse& response) -> Status {
    if (response.has_begin()) {
      begin = response.begin();
      return ok_status();
    }
    if (!begin) return broken("bytes of a file before it said which");
    have += response.data().size();
    if (have > begin->bytes()) return broken(fmt::format("more than the {} bytes of the file", begin->bytes()));
    hash.update(bytes_of(response.data()));
    if (const Status written = file->write(bytes_of(response.data())); !written) return written;
    if (received) received(have, begin->bytes());
    return ok_status();
  };
  const Status done =
      link_->read<pb::GetResultRequest, pb::GetResultResponse>(&Stub::GetResult, request, take, control);
  if (!done) return explain(done.error(), link_->peer());
  if (!begin || have != begin->bytes())
    return broken(fmt::format("{} bytes of a file of {}", have, begin ? begin->bytes() : 0));
  const std::string digest = to_hex(hash.finish());
  if (digest != begin->sha256())
    return broken(fmt::format("a file whose SHA-256 is {}, announced as {}", digest, begin->sha256()));
  if (const Status placed = file->commit(); !placed) return placed.error();
  return *std::move(begin);
}

Result<pb::JobView> JobClient::tiles(const pb::GetResultRequest& request, const std::function<void(pb::Tile)>& tile,
                                     CallControl* control) {
  std::optional<pb::JobView> begin;
  const auto take = [&](pb::GetResultResponse& response) {
    if (response.has_begin()) begin = response.begin();
    if (response.has_tile()) tile(std::move(*response.mutable_tile()));
    return ok_status();
  };
  pb::GetResultRequest as_tiles = request;
  as_tiles.mutable_tiles();  // else the file would come
  const Status done =
      link_->read<pb::GetResultRequest, pb::GetResultResponse>(&Stub::GetResult, as_tiles, take, control);
  if (!done) return explain(done.error(), link_->peer());
  if (!begin) return Error{ErrorCode::internal, "the server at " + link_->peer() + " sent no picture", {}};
  return *std::move(begin);
}

Result<std::string> JobClient::find(const std::string& prefix) {
  // A whole id costs one short call, however many jobs there are.
  auto whole = get(prefix);
  if (whole) return prefix;
  if (whole.error().code != ErrorCode::not_found && whole.error().code != ErrorCode::invalid_argument)
    return whole.error();
  std::vector<std::string> found;
  pb::ListJobsRequest request;
  request.set_page_size(kPage);
  do {
    const auto page = list(request);
    if (!page) return page.error();
    for (const pb::Job& job : page->jobs()) {
      if (job.job_id().starts_with(prefix)) found.push_back(job.job_id());
    }
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  if (found.size() == 1) return found.front();
  if (found.empty()) return Error{ErrorCode::not_found, "no job's id is or begins with '" + prefix + "'", {}};
  std::string ids;
  for (std::size_t i = 0; i < found.size() && i < kNamed; ++i) ids += (i > 0 ? ", " : "") + found[i];
  if (found.size() > kNamed) ids += ", ...";
  return Error{ErrorCode::invalid_argument,
               fmt::format("the ids of {} jobs begin with '{}': {}", found.size(), prefix, ids),
               {}};
}

}  // namespace helio
