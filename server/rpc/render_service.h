// The rpcs of heliograph.v1.RenderService. Each method reads its request, calls the core and turns the outcome into a
// status. All are raw: messages are read and written by parse_message.h and stream_messages.h, tiles without a
// copy.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "heliograph/v1/render_service.grpc.pb.h"
#include "server/compare/compare_core.h"
#include "server/jobs/durable_jobs.h"
#include "server/sessions/service_core.h"

namespace helio {

namespace raw {

using Rpcs = heliograph::v1::RenderService;
// clang-format off
using Service = Rpcs::WithRawCallbackMethod_GetServerInfo<Rpcs::WithRawCallbackMethod_LoadScene<
    Rpcs::WithRawCallbackMethod_ListScenes<Rpcs::WithRawCallbackMethod_UnloadScene<
    Rpcs::WithRawCallbackMethod_CreateSession<Rpcs::WithRawCallbackMethod_CloseSession<
    Rpcs::WithRawCallbackMethod_ListSessions<Rpcs::WithRawCallbackMethod_StreamFrames<
    Rpcs::WithRawCallbackMethod_UpdateSession<Rpcs::WithRawCallbackMethod_WatchFrames<
    Rpcs::WithRawCallbackMethod_RunJob<Rpcs::WithRawCallbackMethod_CancelJob<Rpcs::WithRawCallbackMethod_ReplaySample<
    Rpcs::WithRawCallbackMethod_EditScene<Rpcs::WithRawCallbackMethod_DescribeScene<
    Rpcs::WithRawCallbackMethod_ListFiles<Rpcs::WithRawCallbackMethod_Compare<
    Rpcs::WithRawCallbackMethod_LoadReference<Rpcs::WithRawCallbackMethod_SubmitJob<
    Rpcs::WithRawCallbackMethod_ListJobs<Rpcs::WithRawCallbackMethod_GetJob<Rpcs::WithRawCallbackMethod_WatchJob<
    Rpcs::WithRawCallbackMethod_PauseJob<Rpcs::WithRawCallbackMethod_ResumeJob<
    Rpcs::WithRawCallbackMethod_SetJobPriority<Rpcs::WithRawCallbackMethod_GetResult<
    Rpcs::Service>>>>>>>>>>>>>>>>>>>>>>>>>>;
// clang-format on

}  // namespace raw

class RenderService final : public raw::Service {
 public:
  // jobs: null: the daemon keeps none, for the reason that comes beside it.
  RenderService(CompareCore& compare, DurableJobs* jobs, std::string no_jobs_reason)
      : core_(compare.core), compare_(compare), jobs_(jobs), no_jobs_reason_(std::move(no_jobs_reason)) {}

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* LoadScene(grpc::CallbackServerContext* context,
                                                       grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListScenes(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* UnloadScene(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* CreateSession(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* CloseSession(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamFrames(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* UpdateSession(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchFrames(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* RunJob(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* SubmitJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                   grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchJob(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* PauseJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ResumeJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* SetJobPriority(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                           grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* GetResult(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Compare(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* LoadReference(grpc::CallbackServerContext* context,
                                                           grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ReplaySample(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* EditScene(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;

  grpc::ServerUnaryReactor* DescribeScene(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListFiles(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;

 private:
  // Who calls; null where the call names none of the daemon's tokens, or one whose role is too little for this rpc:
  // then the call ends with the status.
  struct Admission {
    CallerPtr caller;
    grpc::Status refused;
    explicit operator bool() const { return caller != nullptr; }
  };
  Admission admit(const grpc::CallbackServerContext& context, std::string_view rpc) const;
  Error no_jobs() const;
  // permission_denied: the session, scene or kept job is another token's. What is not there is told by whoever looks
  // for it next.
  Status check_session(const Caller& caller, const std::string& session_id) const;
  Status check_scene(const Caller& caller, const std::string& scene_id) const;
  Status check_kept_job(const Caller& caller, const std::string& job_id) const;
  template <class Method>
  Result<pb::Job> change_job(const Caller& caller, const std::string& peer, const std::string& job_id,
                             const Method& method);
  template <class Request, class Method>
  grpc::ServerUnaryReactor* answer_job_call(std::string_view rpc, grpc::CallbackServerContext* context,
                                            const grpc::ByteBuffer* bytes, grpc::ByteBuffer* response, Method method);
  template <class Request, class Make>
  grpc::ServerWriteReactor<grpc::ByteBuffer>* stream_of_jobs(std::string_view rpc, grpc::CallbackServerContext* context,
                                                             const grpc::ByteBuffer* bytes, Make make);

  ServiceCore& core_;
  CompareCore& compare_;
  DurableJobs* const jobs_;
  const std::string no_jobs_reason_;
};

}  // namespace helio
