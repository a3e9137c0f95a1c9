#include "server/rpc/load_scene_reactor.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/log_format.h"
#include "server/base/parse_message.h"
#include "server/base/read_enum.h"
#include "server/base/retry.h"
#include "server/rpc/scene_messages.h"
#include "server/rpc/upload_call.h"
#include "server/stream/convert.h"

namespace helio {
namespace {

constexpr std::size_t kMaxEnvironment = 4096;
constexpr std::size_t kMaxAnimation = 4096;
constexpr std::size_t kMostLogged = 300;  // bytes of a name or an error

// For the log.
std::string name_of(const SceneRequest& request) {
  const auto* bundle = std::get_if<SceneBundle>(&request.files);
  const std::string& name = bundle ? bundle->main_file : std::get<std::string>(request.files);
  return logged(std::string_view(name).substr(0, kMostLogged));
}

Error out_of_order(const char* message, const char* where) {
  return {ErrorCode::invalid_argument, message, where};
}

}  // namespace

struct LoadSceneReactor::Shared : UploadCall<pb::LoadSceneResponse> {
  using UploadCall::UploadCall;

  CancelToken cancel;
  OpenCalls::Place place;  // the scene would be gone with the daemon
};

LoadSceneReactor::LoadSceneReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
                                   grpc::ByteBuffer* response)
    : core_(core), caller_(std::move(caller)), shared_(std::make_shared<Shared>(*this, context, *response)) {
  under_way_ = core.access.begin(caller_, [weak = std::weak_ptr(shared_)](const grpc::Status& status) {
    const auto there = weak.lock();
    if (!there) return;
    there->cancel.cancel();
    there->finish(status);
  });
  if (const Status accepting = core.check_accepting(); !accepting.ok()) {
    shared_->finish(to_grpc_status(accepting));
    return;
  }
  shared_->place = core.open_calls.add([weak = std::weak_ptr(shared_), &core] {
    const auto shared = weak.lock();
    if (!shared) return;
    shared->cancel.cancel();
    shared->finish(to_grpc_status(core.check_accepting()));
  });
  const double seconds = core.config.request_timeout_s;
  message_due_ = std::make_unique<ReadDeadline>(core.timers, seconds, [shared = shared_, seconds] {
    shared->cancel.cancel();
    shared->finish({grpc::StatusCode::DEADLINE_EXCEEDED,
                    fmt::format("the next message of the upload did not come within {} s (request-timeout)", seconds)});
  });
  read();
}

void LoadSceneReactor::read() {
  message_due_->start();
  StartRead(&request_);
}

void LoadSceneReactor::OnReadDone(bool ok) {
  if (!message_due_->stop() || shared_->over()) return;
  Status status = ok_status();
  if (ok) {
    status = guarded([&]() -> Status {
      ArenaMessage<pb::LoadSceneRequest> request;
      if (const Status parsed = parse_message(request_, *request); !parsed.ok()) return parsed;
      return handle(*request);
    });
    request_.Clear();
    if (status.ok()) return read();
  } else if (!shared_->cancel.cancelled()) {
    status = guarded([&] { return submit(); });
  }
  if (!status.ok()) shared_->finish(to_grpc_status(status));
}

Status LoadSceneReactor::handle(const pb::LoadSceneRequest& request) {
  std::vector<std::string> unknown = unknown_fields(request);
  // A request of a kind that only newer daemons know.
  const bool unknown_kind = request.request_case() == pb::LoadSceneRequest::REQUEST_NOT_SET && !unknown.empty();
  shared_->ignore(std::move(unknown));
  if (unknown_kind) return ok_status();
  if (!load_ && request.request_case() != pb::LoadSceneRequest::kBegin) {
    return out_of_order("the first message is not begin", "request");
  }
  switch (request.request_case()) {
    case pb::LoadSceneRequest::kBegin:
      if (load_) return out_of_order("was sent before; allowed: once, as the first message", "begin");
      return begin(request.begin());
    case pb::LoadSceneRequest::kBeginFile:
      if (!upload_) return out_of_order("begin.path was given; allowed: no files", "begin_file");
      return upload_->begin_file(request.begin_file());
    case pb::LoadSceneRequest::kData:
      if (!upload_) return out_of_order("begin.path was given; allowed: no files", "data");
      return upload_->data(request.data());
    case pb::LoadSceneRequest::REQUEST_NOT_SET:
      break;
  }
  return out_of_order("is empty; allowed: one of begin, begin_file, data", "request");
}

Status LoadSceneReactor::begin(const pb::LoadSceneRequest::Begin& begin) {
  Problems problems;
  if (!std::isfinite(begin.time_s())) {
    problems.add("begin.time_s", fmt::format("{}; allowed: finite", begin.time_s()));
  }
  check_constant_enum(*pb::TextureFilter_descriptor(), begin.texture_filter(), pb::TEXTURE_FILTER_BILINEAR,
                      "begin.texture_filter", problems);
  if (begin.environment().size() > kMaxEnvironment) {
    problems.add("begin.environment",
                 fmt::format("{} bytes; allowed: at most {}", begin.environment().size(), kMaxEnvironment));
  } else if (const auto file = names_environment_file(begin.environment()); !file) {
    problems.add("begin.environment", file.error().message);
  }
  if (begin.animation().size() > kMaxAnimation) {
    problems.add("begin.animation",
                 fmt::format("{} bytes; allowed: at most {}", begin.animation().size(), kMaxAnimation));
  }
  if (!begin.path().empty() && !begin.main_file().empty()) {
    problems.add("begin.main_file", "is given beside path; allowed: one of them");
  }
  if (!begin.path().empty() && begin.total_bytes() != 0) {
    problems.add("begin.total_bytes", fmt::format("{} beside path; allowed: 0", begin.total_bytes()));
  }
  if (begin.path().empty() && begin.main_file().empty()) {
    problems.add("begin.path", "is empty and so is main_file; one of them is required");
  }
  if (begin.path().empty()) {
    upload_.emplace(core_.config.max_scene_bytes, core_.memory_of(*caller_));
    if (!begin.main_file().empty() || begin.total_bytes() != 0) upload_->check(begin, problems);
  }
  if (!problems.empty()) return problems.to_error();
  load_.emplace();
  load_->time_s = begin.time_s();
  load_->animation = begin.animation();
  load_->strict = begin.strict();
  load_->environment = begin.environment();
  if (upload_) return upload_->begin(begin);
  load_->files = begin.path();
  return ok_status();
}

Status LoadSceneReactor::submit() {
  if (!load_) return out_of_order("the stream ended before begin", "request");
  if (upload_) {
    auto bundle = upload_->finish();
    if (!bundle) return bundle.error();
    load_->files = std::move(*bundle);
  }
  // The task owns the request, so that dropping it from the loader's queue frees it.
  auto request = std::make_shared<SceneRequest>(std::move(*load_));
  ServiceCore& core = core_;
  const bool taken = core_.loader.submit([shared = shared_, request, &core, caller = caller_] {
    const auto answer = guarded([&]() -> Result<pb::LoadSceneResponse> {
      if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting.error();
      if (const auto* bundle = std::get_if<SceneBundle>(&request->files); bundle && core.keep_upload) {
        if (const std::string told = core.keep_upload(*bundle); !told.empty()) spdlog::warn("{}", told);
      }
      const std::string file = name_of(*request);
      const auto outcome = core.scenes.load(std::move(*request), shared->cancel);
      if (!outcome) {
        spdlog::info("scene refused file={} error={}", file,
                     logged(std::string_view(outcome.error().to_string()).substr(0, kMostLogged)));
        return outcome.error();
      }
      const LoadedScene& scene = *outcome->scene;
      scene.owners.add(caller->name);
      spdlog::info("scene {} scene={} file={} triangles={} load_s={:.3f} build_s={:.3f}",
                   outcome->already_loaded ? "already loaded" : "loaded", scene.id.substr(0, 12), file,
                   scene.snapshot->stats().triangles, scene.load_seconds, scene.snapshot->stats().build_seconds);
      return to_load_response(scene, outcome->already_loaded);
    });
    shared->finish(answer);
  });
  if (taken) return ok_status();
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_queued_loads: {} loads wait already", core_.config.max_queued_loads),
               {},
               kRetrySeconds};
}

void LoadSceneReactor::OnCancel() {
  shared_->cancel.cancel();
  shared_->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

void LoadSceneReactor::OnDone() {
  delete this;
}

}  // namespace helio
