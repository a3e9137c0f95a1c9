#include "server/rpc/render_service.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "renderer/trace/accel/traversal_isa.h"
#include "server/base/access_control.h"
#include "server/base/arena_message.h"
#include "server/base/build_info.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/log_format.h"
#include "server/base/parse_message.h"
#include "server/rpc/call_rights.h"
#include "server/rpc/compare_reactor.h"
#include "server/rpc/edit_scene_reactor.h"
#include "server/rpc/frame_stream_reactor.h"
#include "server/rpc/job_reactor.h"
#include "server/rpc/job_streams.h"
#include "server/rpc/load_reference_reactor.h"
#include "server/rpc/load_scene_reactor.h"
#include "server/rpc/replay_reactor.h"
#include "server/rpc/scene_messages.h"
#include "server/rpc/scene_parts.h"
#include "server/rpc/unary_call.h"
#include "server/rpc/watch_reactor.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"

namespace helio {
namespace {

constexpr double kMaxGrace = 86400;
constexpr std::uint64_t kMaxMessage = 4 << 20;

// Parses, calls `method(request)`, which gives a Result<Response>, and answers.
template <class Request, class Method>
grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context, const grpc::ByteBuffer* bytes,
                                 grpc::ByteBuffer* response, Method&& method) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  grpc::ByteBuffer copy(*bytes);  // shares the slices
  const Status answered = guarded([&]() -> Status {
    ArenaMessage<Request> request;
    if (const Status parsed = parse_message(copy, *request); !parsed.ok()) return parsed;
    tell_ignored(*context, unknown_fields(*request));
    const auto result = method(*request);
    if (!result) return result.error();
    *response = to_bytes(*result);
    return ok_status();
  });
  reactor->Finish(to_grpc_status(answered));
  return reactor;
}

// Of a call that ends at once. Deletes itself when the call is over.
template <class Reactor>
class Refused final : public Reactor {
 public:
  explicit Refused(const grpc::Status& status) { this->Finish(copy_status(status)); }
  void OnDone() override { delete this; }
};

// Of requests that take long: who has a thread for them, and what is answered when too many wait. No thread: such a
// request is answered at once.
struct Later {
  TaskThread* thread = nullptr;
  std::function<Error()> full = {};
};
Later later(ServiceCore& core, const pb::CreateSessionRequest& request) {
  return {&core.thread_for(request.settings().device()), [&core] { return core.too_many_waiting(); }};
}
Later later(ServiceCore& core, const pb::UpdateSessionRequest& request) {
  if (request.has_settings()) return {&core.thread_for(request.settings().device()), [&core] { return core.too_many_waiting(); }};
  if (request.scene_id().empty()) return {};  // nothing large is allocated
  const auto session = core.sessions.find(request.session_id(), "session_id");
  return {session ? core.thread_for_scene(**session) : nullptr, [&core] { return core.too_many_waiting(); }};
}
Later later(ServiceCore& core, const pb::GetServerInfoRequest&) {
  if (core.devices.listed()) return {};
  return {&core.lister, [&core] { return core.too_many_lists(); }};  // until the probe has answered
}
Later later(ServiceCore& core, const pb::ListFilesRequest&) {
  return {&core.lister, [&core] { return core.too_many_lists(); }};
}

// As answer(), on a thread that can take the time: where(request) says which, and none means at once.
template <class Request, class Method, class Where>
class LaterCall final : public UnaryCall {
 public:
  LaterCall(grpc::CallbackServerContext& context, const grpc::ByteBuffer& bytes, grpc::ByteBuffer* response,
            Method method, const Where& where)
      : UnaryCall(response) {
    begin([&]() -> Status {
      const auto request = make_arena_message<Request>();
      grpc::ByteBuffer copy(bytes);  // shares the slices
      if (const Status parsed = parse_message(copy, *request); !parsed.ok()) return parsed;
      tell_ignored(context, unknown_fields(*request));
      const auto answer = [outcome = outcome(), request, method = std::move(method)] {
        if (outcome->cancel.cancelled()) return;  // nobody would know of what is made
        const auto result = guarded([&] { return method(*request); });
        if (result) {
          outcome->finish(*result);
        } else {
          outcome->fail(to_grpc_status(result.error()));
        }
      };
      const Later later = where(*request);
      if (!later.thread) {
        answer();
        return ok_status();
      }
      if (later.thread->submit(answer)) return ok_status();
      return later.full();
    });
  }
};

template <class Request, class Method>
grpc::ServerUnaryReactor* answer_later(ServiceCore& core, grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* bytes, grpc::ByteBuffer* response, Method method) {
  const auto where = [&core](const Request& request) { return later(core, request); };
  return new LaterCall<Request, Method, decltype(where)>(*context, *bytes, response, std::move(method), where);
}

// RunJob has two ways, of which the request alone tells.
bool asks_to_detach(const grpc::ByteBuffer& bytes) {
  ArenaMessage<pb::RunJobRequest> request;
  grpc::ByteBuffer copy(bytes);  // shares the slices
  return guarded([&] { return parse_message(copy, *request); }).ok() && request->detach();
}

// A call about one job: its id is checked before.
template <class Method>
auto with_job(const std::string& id, const Method& method) -> decltype(method()) {
  Problems problems;
  check_id(id, "job_id", problems);
  if (!problems.empty()) return problems.to_error();
  return method();
}

Result<pb::CreateSessionResponse> create_session(ServiceCore& core, const Caller& caller,
                                                 const pb::CreateSessionRequest& request, const std::string& peer) {
  if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting.error();
  Problems problems;
  check_id(request.scene_id(), "scene_id", problems);
  const RenderSettings settings = read_settings(request.settings(), core.render_limits(), "settings", problems);
  const Budget budget = read_budget(request.budget(), "budget", problems);
  double grace_s = core.config.session_grace_s;
  if (request.grace_s() != 0) {
    grace_s = request.grace_s();
    if (!(grace_s > 0 && grace_s <= kMaxGrace)) {
      problems.add("grace_s", fmt::format("{}; allowed: (0, {}] seconds, or 0 for {}", grace_s, kMaxGrace,
                                          core.config.session_grace_s));
    }
  }
  if (!problems.empty()) return problems.to_error();
  if (const Status fits = check_film_size(settings, core.render_limits(), "settings"); !fits.ok()) return fits.error();
  auto scene = core.scenes.acquire(request.scene_id(), "scene_id");
  if (!scene) return scene.error();
  auto session = core.sessions.create(core.resources(caller), std::move(*scene), settings, budget,
                                      grace_s, core.render_limits(), {caller.name, caller.quotas.sessions});
  if (!session) return session.error();
  spdlog::info("session created session={} scene={} size={}x{} peer={}{}", (*session)->id(),
               request.scene_id().substr(0, 12), settings.width, settings.height, logged(peer),
               caller.name.empty() ? "" : " by=" + caller.name);
  pb::CreateSessionResponse response;
  response.set_session_id((*session)->id());
  *response.mutable_settings() = to_message(settings);
  response.set_grace_s(grace_s);
  return response;
}

Result<pb::UpdateSessionResponse> update_session(ServiceCore& core, const pb::UpdateSessionRequest& request) {
  if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting.error();
  Problems problems;
  check_id(request.session_id(), "session_id", problems);
  if (!problems.empty()) return problems.to_error();
  const auto session = core.sessions.find(request.session_id(), "session_id");
  if (!session) return session.error();
  Session::Change change;
  if (request.has_gaze()) {
    if (request.has_view() || request.has_settings() || request.has_budget() || !request.scene_id().empty())
      return Error{ErrorCode::invalid_argument, "is given beside other changes; allowed: alone", "gaze"};
    change.gaze = &request.gaze();
  }
  if (request.has_view()) change.view = &request.view();
  if (request.has_settings()) change.settings = &request.settings();
  if (request.has_budget()) change.budget = &request.budget();
  SceneLease scene;
  if (!request.scene_id().empty()) {
    check_id(request.scene_id(), "scene_id", problems);
    if (!problems.empty()) return problems.to_error();
    auto found = core.scenes.acquire(request.scene_id(), "scene_id");
    if (!found) return found.error();
    scene = std::move(*found);
    change.scene = &scene;
  }
  const auto revision = (*session)->update(change);
  if (!revision) return revision.error();
  pb::UpdateSessionResponse response;
  response.set_revision(*revision);
  return response;
}

Result<pb::ListScenesResponse> list_scenes(const ServiceCore& core, const pb::ListScenesRequest& which) {
  pb::ListScenesResponse list;
  if (which.scene_id().empty()) {
    if (which.first_camera() != 0) {
      return Error{ErrorCode::invalid_argument, fmt::format("{} without scene_id; allowed: 0", which.first_camera()),
                   "first_camera"};
    }
    for (const auto& scene : core.scenes.list()) *list.add_scenes() = to_scene_info(*scene);
    return list;
  }
  Problems problems;
  check_id(which.scene_id(), "scene_id", problems);
  if (!problems.empty()) return problems.to_error();
  const auto scene = core.scenes.find(which.scene_id(), "scene_id");
  if (!scene) return scene.error();
  *list.add_scenes() = to_scene_info(**scene, which.first_camera());
  return list;
}

pb::Device to_device(const vulkan::DeviceInfo& info) {
  pb::Device device;
  device.set_kind("vulkan");
  device.set_name(info.name);
  device.set_index(info.index);
  device.set_driver(info.driver);
  device.set_type(info.type);
  device.set_path_tracing(std::string(vulkan::level_name(info.level)));
  device.set_reason(info.reason);
  device.set_memory_bytes(info.limits.heap_bytes);
  device.set_max_allocation_bytes(info.limits.max_allocation_bytes);
  device.set_api_version(info.api_version);
  device.set_device_uuid(info.device_uuid);
  device.set_driver_uuid(info.driver_uuid);
  return device;
}

pb::GetServerInfoResponse server_info(const ServiceCore& core, bool keeps_jobs) {
  const ServerConfig& config = core.config;
  pb::GetServerInfoResponse response;
  response.set_version(build_version());
  response.set_build(build_description());
  response.set_isa(rendering_isa());
  pb::Device& device = *response.add_devices();
  device.set_kind("embree");
  device.set_name("Embree " + embree_version() + ", traversal by " + traversal_isa());
  const vulkan::DeviceList vulkan = core.devices.list();
  for (const vulkan::DeviceInfo& info : vulkan.devices) *response.add_devices() = to_device(info);
  response.set_no_vulkan_reason(vulkan.reason);
  pb::Limits& limits = *response.mutable_limits();
  limits.set_max_scene_bytes(config.max_scene_bytes);
  limits.set_max_scene_memory(config.max_scene_memory);
  limits.set_max_film_side(config.max_film_side);
  limits.set_max_film_pixels(config.max_film_pixels);
  limits.set_max_sessions(config.max_sessions);
  limits.set_max_jobs(config.max_jobs);
  limits.set_max_queued_jobs(config.max_queued_jobs);
  limits.set_max_memory(config.max_memory);
  limits.set_max_message_bytes(kMaxMessage);
  limits.set_max_scenes(config.max_scenes);
  limits.set_max_reference_memory(config.max_reference_memory);
  limits.set_max_compare_units(config.max_compare_units);
  limits.set_max_compare_pixels(config.max_compare_pixels);
  for (const RenderMode mode : kEveryRenderMode) response.add_modes(to_message(mode));
  for (const Integrator integrator : kEveryIntegrator) response.add_integrators(to_message(integrator));
  response.add_scene_formats("gltf");
  response.add_scene_formats("glb");
  response.add_scene_formats("xml");  // Mitsuba
  response.set_threads(core.engine.threads());
  response.set_draining(core.draining);
  response.set_uptime_s(now_s() - core.started_s);
  response.set_http_address(core.http_address);
  response.set_http_tls(!core.http_address.empty() && !config.tls_certificate.empty());
  response.set_keeps_jobs(keeps_jobs);
  return response;
}

}  // namespace

RenderService::Admission RenderService::admit(const grpc::CallbackServerContext& context, std::string_view rpc) const {
  const auto named = context.client_metadata().find(kAuthorizationKey);
  const bool none = named == context.client_metadata().end();
  CallerPtr caller =
      none ? core_.access.find_header({}) : core_.access.find_header({named->second.data(), named->second.size()});
  if (!caller) {
    return {nullptr,
            {grpc::StatusCode::UNAUTHENTICATED,
             none ? "the call names no token, and this daemon serves those of its token file alone (heliograph "
                    "--token-file FILE, or the header authorization: Bearer TOKEN)"
                  : "the call's token is not in this daemon's token file"}};
  }
  const Status allowed = check_role(*caller, rpc);
  if (!allowed.ok()) return {nullptr, to_grpc_status(allowed)};
  return {std::move(caller), {}};
}

Status RenderService::check_session(const Caller& caller, const std::string& session_id) const {
  const auto session = core_.sessions.find(session_id, "session_id");
  if (!session) return ok_status();
  return check_owner(caller, (*session)->owner(), "session '" + session_id + "'");
}

// Whoever loaded a scene may unload it while nobody else has loaded it, too.
Status RenderService::check_scene(const Caller& caller, const std::string& scene_id) const {
  const auto scene = core_.scenes.find(scene_id, "scene_id");
  if (!scene || caller.role == Role::admin) return ok_status();
  const std::set<std::string> owners = (*scene)->owners.names();
  const auto other = std::find_if(owners.begin(), owners.end(), [&](const auto& name) { return name != caller.name; });
  const std::string what = "scene '" + scene_id.substr(0, 12) + "'";
  return check_owner(caller, other != owners.end() ? *other : owners.empty() ? std::string() : *owners.begin(), what);
}

Status RenderService::check_kept_job(const Caller& caller, const std::string& job_id) const {
  if (caller.role == Role::admin) return ok_status();
  const auto owner = jobs_->owner_of(job_id);
  if (!owner) return ok_status();
  return check_owner(caller, *owner, "job '" + job_id + "'");
}

grpc::ServerUnaryReactor* RenderService::GetServerInfo(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "GetServerInfo");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer_later<pb::GetServerInfoRequest>(
      core_, context, request, response,
      [this](const auto&) { return Result<pb::GetServerInfoResponse>(server_info(core_, jobs_ != nullptr)); });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* RenderService::LoadScene(grpc::CallbackServerContext* context,
                                                                    grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "LoadScene");
  if (!admitted) return new Refused<grpc::ServerReadReactor<grpc::ByteBuffer>>(admitted.refused);
  return new LoadSceneReactor(core_, admitted.caller, *context, response);
}

grpc::ServerUnaryReactor* RenderService::ListScenes(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "ListScenes");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer<pb::ListScenesRequest>(
      context, request, response, [this](const pb::ListScenesRequest& which) { return list_scenes(core_, which); });
}

grpc::ServerUnaryReactor* RenderService::UnloadScene(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "UnloadScene");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer<pb::UnloadSceneRequest>(
      context, request, response,
      [this, &admitted](const pb::UnloadSceneRequest& unload) -> Result<pb::UnloadSceneResponse> {
        Problems problems;
        check_id(unload.scene_id(), "scene_id", problems);
        if (!problems.empty()) return problems.to_error();
        if (const Status own = check_scene(*admitted.caller, unload.scene_id()); !own.ok()) return own.error();
        if (const Status done = core_.scenes.unload(unload.scene_id(), "scene_id"); !done.ok()) return done.error();
        spdlog::info("scene unloaded scene={}", unload.scene_id().substr(0, 12));
        return pb::UnloadSceneResponse();
      });
}

grpc::ServerUnaryReactor* RenderService::DescribeScene(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "DescribeScene");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer<pb::DescribeSceneRequest>(
      context, request, response, [this](const pb::DescribeSceneRequest& which) -> Result<pb::DescribeSceneResponse> {
        Problems problems;
        check_id(which.scene_id(), "scene_id", problems);
        if (!problems.empty()) return problems.to_error();
        const auto scene = core_.scenes.find(which.scene_id(), "scene_id");
        if (!scene) return scene.error();
        return to_scene_parts(**scene, which);
      });
}

grpc::ServerUnaryReactor* RenderService::ListFiles(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "ListFiles");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer_later<pb::ListFilesRequest>(core_, context, request, response,
                                            [this](const pb::ListFilesRequest& which) -> Result<pb::ListFilesResponse> {
                                              const auto found = core_.scenes.roots().list(which.folder(), "folder");
                                              if (!found) return found.error();
                                              return to_list(*found);
                                            });
}

grpc::ServerUnaryReactor* RenderService::CreateSession(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "CreateSession");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer_later<pb::CreateSessionRequest>(
      core_, context, request, response,
      [this, caller = admitted.caller, peer = context->peer()](const pb::CreateSessionRequest& create) {
        return create_session(core_, *caller, create, peer);
      });
}

grpc::ServerUnaryReactor* RenderService::CloseSession(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "CloseSession");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer<pb::CloseSessionRequest>(
      context, request, response,
      [this, &admitted](const pb::CloseSessionRequest& close) -> Result<pb::CloseSessionResponse> {
        Problems problems;
        check_id(close.session_id(), "session_id", problems);
        if (!problems.empty()) return problems.to_error();
        if (const Status own = check_session(*admitted.caller, close.session_id()); !own.ok()) return own.error();
        const Status done = core_.sessions.close(close.session_id(), "session_id", grpc::Status::OK);
        if (!done.ok()) return done.error();
        spdlog::info("session closed session={}", close.session_id());
        return pb::CloseSessionResponse();
      });
}

grpc::ServerUnaryReactor* RenderService::ListSessions(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "ListSessions");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer<pb::ListSessionsRequest>(context, request, response, [this](const auto&) {
    pb::ListSessionsResponse list;
    for (const auto& session : core_.sessions.list()) *list.add_sessions() = session->info();
    return Result<pb::ListSessionsResponse>(std::move(list));
  });
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* RenderService::StreamFrames(
    grpc::CallbackServerContext* context) {
  const Admission admitted = admit(*context, "StreamFrames");
  if (!admitted) return new Refused<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>>(admitted.refused);
  return new FrameStreamReactor(core_, admitted.caller);
}

grpc::ServerUnaryReactor* RenderService::UpdateSession(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "UpdateSession");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return answer_later<pb::UpdateSessionRequest>(
      core_, context, request, response,
      [this, caller = admitted.caller](const pb::UpdateSessionRequest& update) -> Result<pb::UpdateSessionResponse> {
        if (const Status own = check_session(*caller, update.session_id()); !own.ok()) return own.error();
        return update_session(core_, update);
      });
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::WatchFrames(grpc::CallbackServerContext* context,
                                                                       const grpc::ByteBuffer* request) {
  const Admission admitted = admit(*context, "WatchFrames");
  if (!admitted) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(admitted.refused);
  return new WatchReactor(core_, admitted.caller, *request);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::RunJob(grpc::CallbackServerContext* context,
                                                                  const grpc::ByteBuffer* request) {
  const Admission admitted = admit(*context, "RunJob");
  if (!admitted) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(admitted.refused);
  if (!asks_to_detach(*request)) return new JobReactor(core_, admitted.caller, *context, *request);
  return stream_of_jobs<pb::RunJobRequest>(
      "RunJob", context, request, [this, context](const CallerPtr& caller, pb::RunJobRequest&& job) {
        return run_detached_job(core_, *jobs_, std::move(job), caller, asker(*caller, context->peer()));
      });
}

Error RenderService::no_jobs() const {
  return {ErrorCode::failed_precondition, "this daemon keeps no jobs: " + no_jobs_reason_, {}};
}

// Calls method(caller, request), which gives a Result<Response>, on a thread that may wait for the disk.
template <class Request, class Method>
grpc::ServerUnaryReactor* RenderService::answer_job_call(std::string_view rpc, grpc::CallbackServerContext* context,
                                                         const grpc::ByteBuffer* bytes, grpc::ByteBuffer* response,
                                                         Method method) {
  const Admission admitted = admit(*context, rpc);
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  if (!jobs_) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(to_grpc_status(no_jobs()));
    return reactor;
  }
  const auto where = [&jobs = *jobs_](const Request&) {
    return Later{&jobs.calls(), [&jobs] { return jobs.too_many_calls(); }};
  };
  auto of_caller = [caller = admitted.caller, method = std::move(method)](const Request& request) {
    return method(*caller, request);
  };
  return new LaterCall<Request, decltype(of_caller), decltype(where)>(*context, *bytes, response, std::move(of_caller),
                                                                      where);
}

// Sends what make(caller, request), a PulledStream::Make, makes.
template <class Request, class Make>
grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::stream_of_jobs(std::string_view rpc,
                                                                          grpc::CallbackServerContext* context,
                                                                          const grpc::ByteBuffer* bytes, Make make) {
  const Admission admitted = admit(*context, rpc);
  if (!admitted) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(admitted.refused);
  if (!jobs_) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(to_grpc_status(no_jobs()));
  Request request;
  grpc::ByteBuffer copy(*bytes);  // shares the slices
  const Status parsed = guarded([&]() -> Status {
    if (const Status done = parse_message(copy, request); !done.ok()) return done;
    tell_ignored(*context, unknown_fields(request));
    return ok_status();
  });
  if (!parsed.ok()) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(to_grpc_status(parsed));
  return new PulledStream(jobs_->calls(), jobs_->too_many_calls(), core_.access, admitted.caller,
                          make(admitted.caller, std::move(request)));
}

grpc::ServerUnaryReactor* RenderService::CancelJob(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const auto of_call = [this](const Caller& caller,
                              const pb::CancelJobRequest& cancel) -> Result<pb::CancelJobResponse> {
    Problems problems;
    check_id(cancel.job_id(), "job_id", problems);
    if (!problems.empty()) return problems.to_error();
    if (const auto owner = core_.jobs.owner_of(cancel.job_id())) {
      if (const Status own = check_owner(caller, *owner, "job '" + cancel.job_id() + "'"); !own.ok())
        return own.error();
    }
    if (const Status done = core_.jobs.cancel(cancel.job_id(), "job_id"); !done.ok()) return done.error();
    return pb::CancelJobResponse();
  };
  if (!jobs_) {
    const Admission admitted = admit(*context, "CancelJob");
    if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
    return answer<pb::CancelJobRequest>(context, request, response, [&](const pb::CancelJobRequest& cancel) {
      return of_call(*admitted.caller, cancel);
    });
  }
  return answer_job_call<pb::CancelJobRequest>(
      "CancelJob", context, request, response,
      [this, of_call, peer = context->peer()](const Caller& caller,
                                              const pb::CancelJobRequest& cancel) -> Result<pb::CancelJobResponse> {
        auto done = of_call(caller, cancel);
        if (done || done.error().code != ErrorCode::not_found) return done;
        if (const Status own = check_kept_job(caller, cancel.job_id()); !own.ok()) return own.error();
        if (const Status kept = jobs_->cancel(cancel.job_id(), asker(caller, peer)); !kept.ok()) return kept.error();
        return pb::CancelJobResponse();
      });
}

grpc::ServerUnaryReactor* RenderService::SubmitJob(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return answer_job_call<pb::SubmitJobRequest>(
      "SubmitJob", context, request, response,
      [this, peer = context->peer()](const Caller& caller, const pb::SubmitJobRequest& submit) {
        return jobs_->submit(submit, caller, asker(caller, peer));
      });
}

grpc::ServerUnaryReactor* RenderService::ListJobs(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return answer_job_call<pb::ListJobsRequest>(
      "ListJobs", context, request, response,
      [this](const Caller&, const pb::ListJobsRequest& which) { return jobs_->list(which); });
}

grpc::ServerUnaryReactor* RenderService::GetJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                                grpc::ByteBuffer* response) {
  return answer_job_call<pb::GetJobRequest>(
      "GetJob", context, request, response, [this](const Caller&, const pb::GetJobRequest& which) {
        return with_job(which.job_id(), [&] { return jobs_->get(which.job_id()); });
      });
}

// Calls method(job_id, by) if the kept job is the caller's own, or the caller may act on others'.
template <class Method>
Result<pb::Job> RenderService::change_job(const Caller& caller, const std::string& peer, const std::string& job_id,
                                          const Method& method) {
  return with_job(job_id, [&]() -> Result<pb::Job> {
    if (const Status own = check_kept_job(caller, job_id); !own.ok()) return own.error();
    return method(job_id, asker(caller, peer));
  });
}

grpc::ServerUnaryReactor* RenderService::PauseJob(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  return answer_job_call<pb::PauseJobRequest>(
      "PauseJob", context, request, response,
      [this, peer = context->peer()](const Caller& caller, const pb::PauseJobRequest& which) {
        return change_job(caller, peer, which.job_id(),
                          [&](const auto& id, const auto& by) { return jobs_->pause(id, by); });
      });
}

grpc::ServerUnaryReactor* RenderService::ResumeJob(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return answer_job_call<pb::ResumeJobRequest>(
      "ResumeJob", context, request, response,
      [this, peer = context->peer()](const Caller& caller, const pb::ResumeJobRequest& which) {
        return change_job(caller, peer, which.job_id(),
                          [&](const auto& id, const auto& by) { return jobs_->resume(id, by); });
      });
}

grpc::ServerUnaryReactor* RenderService::SetJobPriority(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  return answer_job_call<pb::SetJobPriorityRequest>(
      "SetJobPriority", context, request, response,
      [this, peer = context->peer()](const Caller& caller, const pb::SetJobPriorityRequest& which) {
        return change_job(caller, peer, which.job_id(),
                          [&](const auto& id, const auto&) { return jobs_->set_priority(id, which.priority()); });
      });
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::WatchJob(grpc::CallbackServerContext* context,
                                                                    const grpc::ByteBuffer* request) {
  return stream_of_jobs<pb::WatchJobRequest>(
      "WatchJob", context, request,
      [this](const CallerPtr&, pb::WatchJobRequest&& which) { return watch_job(core_, *jobs_, std::move(which)); });
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::GetResult(grpc::CallbackServerContext* context,
                                                                     const grpc::ByteBuffer* request) {
  return stream_of_jobs<pb::GetResultRequest>(
      "GetResult", context, request,
      [this](const CallerPtr& caller, pb::GetResultRequest&& which) {
        return get_result(core_, *jobs_, std::move(which), caller);
      });
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RenderService::Compare(grpc::CallbackServerContext* context,
                                                                   const grpc::ByteBuffer* request) {
  const Admission admitted = admit(*context, "Compare");
  if (!admitted) return new Refused<grpc::ServerWriteReactor<grpc::ByteBuffer>>(admitted.refused);
  return new CompareReactor(compare_, admitted.caller, *context, *request);
}

grpc::ServerReadReactor<grpc::ByteBuffer>* RenderService::LoadReference(grpc::CallbackServerContext* context,
                                                                        grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "LoadReference");
  if (!admitted) return new Refused<grpc::ServerReadReactor<grpc::ByteBuffer>>(admitted.refused);
  return new LoadReferenceReactor(compare_, admitted.caller, *context, response);
}

grpc::ServerUnaryReactor* RenderService::ReplaySample(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "ReplaySample");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return new ReplayReactor(core_, *context, *request, response);
}

grpc::ServerUnaryReactor* RenderService::EditScene(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request, grpc::ByteBuffer* response) {
  const Admission admitted = admit(*context, "EditScene");
  if (!admitted) return new Refused<grpc::ServerUnaryReactor>(admitted.refused);
  return new EditSceneReactor(core_, admitted.caller, *context, *request, response);
}

}  // namespace helio
