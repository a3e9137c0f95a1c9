#include "client/render_client.h"

#include <grpcpp/create_channel.h>

#include <algorithm>
#include <optional>

#include "client/reference_upload.h"
#include "client/scene_upload.h"
#include "client/server_address.h"
#include "client/tls/credentials.h"
#include "client/tls/diagnosis.h"
#include "renderer/base/clock.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

// The table of a comparison of many views is larger than gRPC's 4 MiB.
constexpr int kMaxReceivedMessage = 64 << 20;

// Waits until the channel is connected. The state machine of gRPC tries by itself, with a growing pause in between;
// without `retry` the first failure is final.
bool wait_until_ready(grpc::Channel& channel, const ConnectOptions& options) {
  const auto deadline = deadline_in(options.timeout_s);
  grpc_connectivity_state state = channel.GetState(true);
  while (state != GRPC_CHANNEL_READY) {
    if (state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE && !options.retry) return false;
    if (!channel.WaitForStateChange(state, deadline)) return false;
    state = channel.GetState(true);
  }
  return true;
}

}  // namespace

Result<std::unique_ptr<RenderClient>> RenderClient::connect(const std::string& address, const ConnectOptions& options) {
  Status valid = validate_server_address(address);
  if (!valid) return valid.error();
  auto credentials = make_channel_credentials(options.tls);
  if (!credentials) return credentials.error();
  if (!options.token.empty() && !options.tls.on && !is_loopback(address) && options.notice)
    options.notice("the token travels unencrypted to " + address + " and can be read on its way; --tls prevents that");
  grpc::ChannelArguments arguments;
  if (options.tls.on && !options.tls.name.empty()) arguments.SetSslTargetNameOverride(options.tls.name);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // Despite its name this is how long one attempt may take: a busy daemon or a slow link gets all the time there is.
  const double attempt_ms = std::clamp(options.timeout_s, 0.1, 3600.0) * 1000;
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, static_cast<int>(attempt_ms));
  // A proxy for the web must not swallow calls to a daemon on this machine or at the end of a tunnel.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(kMaxReceivedMessage);
  // Two clients of one process never share a connection: one that stops reading must not hold the other back.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::shared_ptr<grpc::Channel> channel = grpc::CreateCustomChannel(address, *credentials, arguments);
  if (!wait_until_ready(*channel, options)) {
    const std::string why = diagnose_tls(address, options.tls);
    if (why.empty()) return Error{ErrorCode::unavailable, "no server answers at " + address, {}};
    return Error{ErrorCode::unavailable, "no connection to the server at " + address + ": " + why, {}};
  }
  return std::make_unique<RenderClient>(std::move(channel), address, options);
}

RenderClient::RenderClient(std::shared_ptr<grpc::Channel> channel, std::string peer, const ConnectOptions& options)
    : link_(std::make_shared<const ServiceLink>(std::move(channel), std::move(peer), options)) {}

namespace {

template <class T>
Status without_value(const Result<T>& result) {
  if (!result) return result.error();
  return ok_status();
}

using Stub = ServiceLink::Stub;

}  // namespace

bool RenderClient::reach(double seconds) {
  return seconds > 0 && link_->reach(seconds);
}

Result<pb::GetServerInfoResponse> RenderClient::server_info() {
  return link_->call(&Stub::GetServerInfo, pb::GetServerInfoRequest());
}

Result<pb::LoadSceneResponse> RenderClient::upload_scene(const LocalScene& scene, const SceneLoadRequest& request,
                                                         CallControl* control) {
  return link_->upload<pb::LoadSceneRequest, pb::LoadSceneResponse>(
      &Stub::LoadScene, [&](auto& call) { return write_scene(call, scene, request); }, control);
}

Result<pb::LoadSceneResponse> RenderClient::load_server_scene(const std::string& path, const std::string& environment,
                                                              const SceneLoadRequest& request, CallControl* control) {
  pb::LoadSceneRequest message;
  message.mutable_begin()->set_path(path);
  message.mutable_begin()->set_environment(environment);
  message.mutable_begin()->set_time_s(request.time_s);
  message.mutable_begin()->set_animation(request.animation);
  message.mutable_begin()->set_strict(request.strict);
  // A write fails where the server has ended the call, whose status tells why.
  const auto write = [&](grpc::ClientWriterInterface<pb::LoadSceneRequest>& call) {
    call.Write(message);
    return ok_status();
  };
  return link_->upload<pb::LoadSceneRequest, pb::LoadSceneResponse>(&Stub::LoadScene, write, control);
}

Result<pb::ListScenesResponse> RenderClient::list_scenes() {
  return link_->call(&Stub::ListScenes, pb::ListScenesRequest());
}

Status RenderClient::complete_cameras(pb::SceneInfo& scene) {
  while (std::uint32_t(scene.cameras_size()) < scene.camera_total()) {
    pb::ListScenesRequest request;
    request.set_scene_id(scene.scene_id());
    request.set_first_camera(std::uint32_t(scene.cameras_size()));
    const auto page = link_->call(&Stub::ListScenes, request);
    if (!page) return page.error();
    if (page->scenes_size() != 1 || page->scenes(0).cameras().empty())
      return Error{ErrorCode::internal, "the server does not tell all cameras of the scene", peer()};
    scene.mutable_cameras()->MergeFrom(page->scenes(0).cameras());
  }
  return ok_status();
}

Status RenderClient::unload_scene(const std::string& scene_id) {
  pb::UnloadSceneRequest request;
  request.set_scene_id(scene_id);
  return without_value(link_->call(&Stub::UnloadScene, request));
}

Result<pb::EditSceneResponse> RenderClient::edit_scene(const pb::EditSceneRequest& request, CallControl* control) {
  grpc::ClientContext context;
  link_->authorize(context);
  const CallControl::Scope scope(control, context);
  pb::EditSceneResponse response;
  const Status done = link_->status_of(link_->stub().EditScene(&context, request, &response), context);
  if (!done) return done.error();
  return response;
}

Result<pb::CreateSessionResponse> RenderClient::create_session(const pb::CreateSessionRequest& request) {
  return link_->call(&Stub::CreateSession, request);
}

Status RenderClient::close_session(const std::string& session_id) {
  pb::CloseSessionRequest request;
  request.set_session_id(session_id);
  return without_value(link_->call(&Stub::CloseSession, request));
}

Result<pb::ListSessionsResponse> RenderClient::list_sessions() {
  return link_->call(&Stub::ListSessions, pb::ListSessionsRequest());
}

Result<std::uint64_t> RenderClient::update_session(const pb::UpdateSessionRequest& request) {
  auto response = link_->call(&Stub::UpdateSession, request);
  if (!response) return response.error();
  return response->revision();
}

std::unique_ptr<FrameStream> RenderClient::stream_frames(const pb::StreamRequest::Open& open,
                                                         FrameCallbacks callbacks) {
  return std::make_unique<FrameStream>(link_->stub(), peer(), open, std::move(callbacks),
                                       [this](grpc::ClientContext& context) { link_->authorize(context); });
}

Status RenderClient::watch_frames(const pb::WatchFramesRequest& request, const FrameCallbacks& callbacks,
                                  CallControl* control) {
  const auto take = [&](pb::StreamResponse& response) {
    dispatch(response, callbacks);
    return ok_status();
  };
  return link_->read<pb::WatchFramesRequest, pb::StreamResponse>(&Stub::WatchFrames, request, take, control);
}

Result<pb::FrameEnd> RenderClient::run_job(const pb::RunJobRequest& request, const JobCallbacks& callbacks,
                                           CallControl* control) {
  std::optional<pb::FrameEnd> end;
  const auto take = [&](pb::RunJobResponse& response) {
    if (response.has_accepted() && callbacks.accepted) callbacks.accepted(response.accepted());
    if (response.has_progress() && callbacks.progress) callbacks.progress(response.progress());
    if (response.has_tile() && callbacks.tile) callbacks.tile(std::move(*response.mutable_tile()));
    if (response.has_view_result() && callbacks.view_result) callbacks.view_result(response.view_result());
    if (response.has_result()) end = response.result().end();
    return ok_status();
  };
  const Status done = link_->read<pb::RunJobRequest, pb::RunJobResponse>(&Stub::RunJob, request, take, control);
  if (!done) return done.error();
  if (!end) return Error{ErrorCode::internal, "the server ended the job without a result", {}};
  return *std::move(end);
}

Status RenderClient::cancel_job(const std::string& job_id) {
  pb::CancelJobRequest request;
  request.set_job_id(job_id);
  return without_value(link_->call(&Stub::CancelJob, request));
}

Result<pb::CompareResponse::Result> RenderClient::compare(const pb::CompareRequest& request,
                                                          const CompareCallbacks& callbacks, CallControl* control) {
  std::optional<pb::CompareResponse::Result> result;
  const auto take = [&](pb::CompareResponse& response) {
    if (response.has_accepted() && callbacks.accepted) callbacks.accepted(response.accepted());
    if (response.has_progress() && callbacks.progress) callbacks.progress(response.progress());
    if (response.has_reference() && callbacks.reference) callbacks.reference(response.reference());
    if (response.has_unit() && callbacks.unit) callbacks.unit(response.unit());
    if (response.has_picture() && callbacks.picture) callbacks.picture(std::move(*response.mutable_picture()));
    if (response.has_result()) result = std::move(*response.mutable_result());
    return ok_status();
  };
  const Status done = link_->read<pb::CompareRequest, pb::CompareResponse>(&Stub::Compare, request, take, control);
  if (!done) return done.error();
  if (!result) return Error{ErrorCode::internal, "the server ended the comparison without a result", {}};
  return *std::move(result);
}

Result<pb::LoadReferenceResponse> RenderClient::load_reference(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& uploaded, CallControl* control) {
  return link_->upload<pb::LoadReferenceRequest, pb::LoadReferenceResponse>(
      &Stub::LoadReference, [&](auto& call) { return write_reference(call, path, uploaded); }, control);
}

Result<pb::ReplaySampleResponse> RenderClient::replay_sample(const std::string& token, CallControl* control) {
  pb::ReplaySampleRequest request;
  request.set_token(token);
  return link_->call(&Stub::ReplaySample, request, control);
}

}  // namespace helio
