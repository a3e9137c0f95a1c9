#include "client/frame_stream.h"

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/grpc_error.h"

namespace helio {

namespace pb = heliograph::v1;

void dispatch(pb::StreamResponse& response, const FrameCallbacks& callbacks) {
  switch (response.response_case()) {
    case pb::StreamResponse::kOpened:
      if (callbacks.opened) callbacks.opened(response.opened());
      break;
    case pb::StreamResponse::kFrameBegin:
      if (callbacks.frame_begin) callbacks.frame_begin(response.frame_begin());
      break;
    case pb::StreamResponse::kTile:
      if (callbacks.tile) callbacks.tile(std::move(*response.mutable_tile()));
      break;
    case pb::StreamResponse::kFrameEnd:
      if (callbacks.frame_end) callbacks.frame_end(response.frame_end());
      break;
    case pb::StreamResponse::kNotice:
      if (callbacks.notice) callbacks.notice(response.notice());
      break;
    case pb::StreamResponse::kProgress:
      if (callbacks.progress) callbacks.progress(response.progress());
      break;
    case pb::StreamResponse::RESPONSE_NOT_SET:
      break;  // something a newer server says
  }
}

struct FrameStream::Impl {
  std::string peer;
  FrameCallbacks callbacks;
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReaderWriterInterface<pb::StreamRequest, pb::StreamResponse>> call;
  std::mutex write_mutex;
  bool writes_done = false;

  std::mutex end_mutex;
  std::condition_variable ended;
  std::optional<Status> end;
  std::thread reader;

  Status write(const pb::StreamRequest& request) {
    std::lock_guard lock(write_mutex);
    if (!writes_done && call->Write(request)) return ok_status();
    return Error{ErrorCode::unavailable, "the stream to " + peer + " is over", {}};
  }

  void read_all() {
    pb::StreamResponse response;
    while (call->Read(&response)) dispatch(response, callbacks);
    {
      std::lock_guard lock(write_mutex);
      if (!writes_done) call->WritesDone();
      writes_done = true;
    }
    const grpc::Status status = call->Finish();
    const Status outcome = status.ok() ? ok_status() : Status(to_error(status, peer));
    if (callbacks.ended) callbacks.ended(outcome);
    std::lock_guard lock(end_mutex);
    end = outcome;
    ended.notify_all();
  }
};

FrameStream::FrameStream(pb::RenderService::StubInterface& stub, std::string peer, const pb::StreamRequest::Open& open,
                         FrameCallbacks callbacks, const std::function<void(grpc::ClientContext&)>& prepare)
    : impl_(std::make_unique<Impl>()) {
  impl_->peer = std::move(peer);
  impl_->callbacks = std::move(callbacks);
  prepare(impl_->context);
  impl_->call = stub.StreamFrames(&impl_->context);
  pb::StreamRequest request;
  *request.mutable_open() = open;
  impl_->call->Write(request);  // a failure shows when reading
  impl_->reader = std::thread([this] { impl_->read_all(); });
}

FrameStream::~FrameStream() {
  impl_->context.TryCancel();
  impl_->reader.join();
}

Status FrameStream::send_view(const pb::View& view) {
  pb::StreamRequest request;
  *request.mutable_view() = view;
  return impl_->write(request);
}

Status FrameStream::send_settings(const pb::RenderSettings& settings) {
  pb::StreamRequest request;
  *request.mutable_settings() = settings;
  return impl_->write(request);
}

Status FrameStream::send_budget(const pb::Budget& budget) {
  pb::StreamRequest request;
  *request.mutable_budget() = budget;
  return impl_->write(request);
}

Status FrameStream::send_credit(std::uint32_t tiles) {
  pb::StreamRequest request;
  request.mutable_credit()->set_tiles(tiles);
  return impl_->write(request);
}

Status FrameStream::send_scene(const std::string& scene_id) {
  pb::StreamRequest request;
  request.mutable_scene()->set_scene_id(scene_id);
  return impl_->write(request);
}

Status FrameStream::close(bool close_session) {
  pb::StreamRequest request;
  request.mutable_close()->set_close_session(close_session);
  Status sent = impl_->write(request);
  std::lock_guard lock(impl_->write_mutex);
  if (!impl_->writes_done) impl_->call->WritesDone();
  impl_->writes_done = true;
  return sent;
}

void FrameStream::cancel() {
  impl_->context.TryCancel();
}

Status FrameStream::wait() {
  std::unique_lock lock(impl_->end_mutex);
  impl_->ended.wait(lock, [this] { return impl_->end.has_value(); });
  return *impl_->end;
}

}  // namespace helio
